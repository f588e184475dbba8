/** A frame as the server sent it. */
export interface Frame {
  number: number;
  /** Seconds, on the clock of the stream. */
  time: number;
  /** One weight for each of `LiveFace.curves`. */
  values: Float32Array;
  /** A quaternion xyzw for each of `LiveFace.joints`. */
  turns: Float32Array;
}

export interface Options {
  /** What a server that lets other machines in asks for. */
  token?: string;
  /** Which face to watch and to move; "main" unless said. */
  face?: string;
  shapes?: "arkit" | "vrm" | "elocute";
  /** What sounds are played by, and whose clock counts. Without it nothing is heard. */
  context?: AudioContext | null;
}

/** What a joint's turn is written to: a three.js bone whose rest is no turn. */
export interface Joint {
  quaternion: { fromArray(values: ArrayLike<number>, offset?: number): { normalize(): unknown } };
}

/** A mesh with morph targets, a three.js object above such meshes, or a VRM of @pixiv/three-vrm. */
export type Attachable =
  | { morphTargetDictionary?: Record<string, number>; morphTargetInfluences?: number[] | Float32Array }
  | { traverse(each: (object: any) => void): void }
  | { expressionManager?: { getExpression(name: string): unknown; setValue(name: string, weight: number): void } };

/**
 * A face that `elocute live` moves. It connects at once, and again where the connection ends.
 *
 * Events: "welcome", "started", "ended", "interrupted", "dropped" and "error" as the server tells
 * them (`detail`), "frame" (`detail` is a `Frame`), "spoken" once a sound was heard, "closed".
 */
export class LiveFace extends EventTarget {
  constructor(url: string, options?: Options);
  /** Whether the server has said welcome. */
  readonly ready: boolean;
  readonly curves: string[];
  readonly joints: string[];
  /** The weights and turns that are shown now. */
  readonly values: Float32Array;
  readonly turns: Float32Array;
  /** Move what `update` shows; the function that comes back takes it off again. */
  attach(object: Attachable, joints?: Record<string, Joint>): () => void;
  /** Show the frame that is due, and give its time in s; call it before each picture. */
  update(): number | undefined;
  /** The time of the frame that is due, s; -Infinity before the first. */
  time(now?: number): number;
  /** Say a sound: it is sent whole, heard, and seen. */
  speak(samples: Float32Array | Int16Array, rate: number): void;
  /** The same in blocks, as a speech engine gives them. */
  begin(rate: number): void;
  write(samples: Float32Array | Int16Array): void;
  finish(): void;
  /** Stop at once. */
  interrupt(): void;
  /** Whether the sound that follows is a partner's. */
  listen(on: boolean): void;
  /** Send the microphone, which is not heard; the function that comes back ends it. */
  microphone(constraints?: MediaTrackConstraints | boolean): Promise<() => void>;
  close(): void;
}
