// Bars of a few curves, as the face has them.

const SHOWN = [
  "jawOpen", "mouthClose", "mouthPucker", "mouthFunnel", "mouthLabiodental", "mouthStretchLeft",
  "tongueTipUp", "eyeBlinkLeft",
];

export class CurveBars {
  constructor(room, mesh) {
    this.mesh = mesh;
    const places = mesh ? mesh.morphTargetDictionary : {};
    this.rows = SHOWN.filter((name) => name in places).map((name) => {
      const row = document.createElement("div");
      const label = document.createElement("span");
      const bar = document.createElement("i");
      label.textContent = name;
      row.append(label, bar);
      room.append(row);
      return [bar, places[name]];
    });
  }

  show() {
    this.rows.forEach(([bar, index]) => {
      bar.style.transform = `scaleX(${this.mesh.morphTargetInfluences[index].toFixed(3)})`;
    });
  }
}
