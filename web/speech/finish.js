// Contacts made exact, and what a style adds, as elocute.articulation.driver.finish_decoded.
import { clip, smoothstep } from "./arrays.js";

/** The middle of a contact, without the way to it and from it. */
const held = (gate, from) => smoothstep(clip((gate - from) / (1 - from)));

export class Finish {
  constructor({ driver, curves }, style) {
    this.at = driver;
    this.style = style;
    const smiles = ["Left", "Right"].map((side) => style.smile + driver.ONE_SIDED_SMILE * Math.max(0, side === "Left" ? -style.asymmetry : style.asymmetry));
    const cheeks = ["cheekSquintLeft", "cheekSquintRight"].filter((_, side) => smiles[side]);
    this.names = [...curves, ...cheeks];
    this.smiles = smiles;
    this.places = Object.fromEntries(this.names.map((name, at) => [name, at]));
  }

  /** One frame of curves, with how far the lips are shut, and the lower lip is at the teeth. */
  frame(mouth, seal, teeth) {
    const { places } = this, { HELD_FROM } = this.at;
    const face = new Float32Array(this.names.length);
    face.set(mouth);
    this.bite(face, held(teeth, HELD_FROM));
    this.press(face, seal);
    const closed = held(seal, HELD_FROM);
    this.part(face, 1 - closed);
    this.press(face, closed);
    face[places.mouthClose] += closed * (face[places.jawOpen] - face[places.mouthClose]);
    this.pose(face);
    return face.map((value) => clip(value));
  }

  part(face, share) {
    for (const name of this.at.PARTING) if (name in this.places) face[this.places[name]] *= share;
  }

  /** The lower lip meets the teeth; jaw and rounding stay as far as it can. */
  bite(face, gate) {
    const { LABIODENTAL, BITTEN_MOST } = this.at, { jawOpen, mouthClose, mouthLabiodental } = this.places;
    this.part(face, 1 - gate);
    face[mouthLabiodental] = Math.max(face[mouthLabiodental], gate);
    for (const [name, most] of Object.entries(BITTEN_MOST)) face[this.places[name]] = Math.min(face[this.places[name]], 1 - gate * (1 - most));
    face[jawOpen] = Math.max(face[jawOpen], gate * LABIODENTAL.jawOpen);
    face[mouthClose] += gate * (Math.max(face[jawOpen] - LABIODENTAL.jawOpen, 0) - face[mouthClose]);
  }

  /** The lower lip leaves the teeth, and lips are pressed as in p. */
  press(face, gate) {
    face[this.places.mouthLabiodental] *= 1 - gate;
    for (const [name, weight] of Object.entries(this.at.VISEME_SHAPES.PP)) {
      const place = this.places[name];
      if (name !== "jawOpen" && name !== "mouthClose") face[place] = Math.max(face[place], gate * weight);
    }
  }

  /** A style's constant smile, and less on the side that it does not favour. */
  pose(face) {
    const { CHEEK_OF_SMILE, ASYMMETRY_REACH } = this.at, { asymmetry } = this.style;
    ["Left", "Right"].forEach((side, at) => {
      const smile = this.smiles[at];
      if (!smile) return;
      const place = this.places[`mouthSmile${side}`];
      face[place] = clip(face[place] + smile);
      face[this.places[`cheekSquint${side}`]] = CHEEK_OF_SMILE * smile;
    });
    const weak = asymmetry > 0 ? "Left" : "Right";
    this.names.forEach((name, at) => {
      if (name.startsWith("mouth") && name.endsWith(weak)) face[at] *= 1 - ASYMMETRY_REACH * Math.abs(asymmetry);
    });
  }
}
