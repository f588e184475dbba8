// What pages leave for a script or a test to hold on to.
interface Window {
  elocute: any;
}

// Whoever uses web/speech installs it, or gives it as `ort`.
declare module "onnxruntime-web/wasm";
