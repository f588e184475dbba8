/** Numbers of a speaking style, as in Elocute's `Style`; those that are left out are a plain speaker's. */
export type Style = Partial<Record<
  | "amplitude" | "rounding" | "spread" | "upper_lip" | "asymmetry" | "smile" | "parted_mm"
  | "anticipation_s" | "carry_s",
  number
>>;

export interface Settings {
  /** Samples a second of the sound that is pushed, Hz; 16000 unless said. */
  rate?: number;
  /** Frames a second, 1 to 240; 60 unless said. */
  fps?: number;
  /**
   * How much later than its time a frame comes, s: 0.21 and more at 16 kHz, 0.212 at other rates.
   * "exact", as it is unless said, waits for all that bears on a frame, about 1.5 s.
   */
  lookahead?: number | "exact";
  /** A name (plain, calm, broad, mumble, crisp, rounded, smiling, wry, tense, drawl, pouting, lopsided) or numbers. */
  style?: string | Style;
  /** How far the mouth moves, 0 to 2; it does not change whether the lips close. */
  strength?: number;
}

/** What runs networks: an InferenceSession of onnxruntime-web. */
export interface Session {
  run(inputs: Record<string, unknown>): Promise<Record<string, { data: unknown }>>;
}

export interface Options extends Settings {
  /** trunk.onnx: its address, its bytes, or the `session` of another stream. */
  trunk: string | URL | ArrayBuffer | Uint8Array | Session;
  /** tables.json: its address, or what is in it. */
  tables: string | URL | Record<string, any>;
  /** onnxruntime-web; imported from "onnxruntime-web/wasm" unless given. */
  ort?: any;
}

export interface Frames {
  /** The number of the first; frame k is at k / fps seconds. */
  first: number;
  count: number;
  /** ARKit's names, and three shapes for speech: mouthLabiodental, tongueDental and tongueTipUp. */
  names: string[];
  fps: number;
  /** count × names.length, frame after frame, 0 to 1. */
  values: Float32Array;
}

/** Sound in, frames out. Blocks are taken in order, whether or not one waits for the answers. */
export interface Speech {
  readonly names: string[];
  readonly fps: number;
  readonly rate: number;
  /** How much sound after its own time a frame waits for, s. */
  readonly lookahead: number;
  /** The network, for further streams. */
  readonly session: Session;
  /** Mono samples within ±1, or 16-bit integers, of any length: the frames that are known now. */
  push(samples: Float32Array | Int16Array): Promise<Frames | null>;
  /** End the sound: the remaining frames. */
  flush(): Promise<Frames | null>;
}

/** Open a stream. Raises RangeError for settings and sound that cannot be used. */
export function createSpeech(options: Options): Promise<Speech>;
