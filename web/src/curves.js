// What moves the face: bars of a few curves, and a table of all.

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
      const track = document.createElement("div");
      const bar = document.createElement("i");
      label.textContent = name;
      track.append(bar);
      row.append(label, track);
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

// A line for each frame, a column for each shape; pose(time) moves the mesh.
export function curveTable(mesh, take, pose) {
  const places = Object.entries(mesh?.morphTargetDictionary ?? {});
  const lines = [["time_s", ...places.map(([name]) => name)].join(",")];
  for (let frame = 0; frame < Math.round(take.duration * take.fps); frame++) {
    const time = frame / take.fps;
    pose(time);
    const values = places.map(([, index]) => String(+mesh.morphTargetInfluences[index].toFixed(5)));
    lines.push([time.toFixed(4), ...values].join(","));
  }
  return `${lines.join("\n")}\n`;
}
