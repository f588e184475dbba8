// Signs on buttons, in the strokes of the viewer's.
const PATHS = {
  play: "M5 2.5v13l10.5-6.5z",
  pause: "M4 3h3.6v12H4zM10.4 3H14v12h-3.6z",
  loop: "M3 9V7.5A2.5 2.5 0 0 1 5.5 5H14M11.5 2.5 14 5l-2.5 2.5M15 9v1.5a2.5 2.5 0 0 1-2.5 2.5H4M6.5 15.5 4 13l2.5-2.5",
  undo: "M6.5 3.5 3 7l3.5 3.5M3 7h7a4.5 4.5 0 0 1 0 8H7",
  redo: "M11.5 3.5 15 7l-3.5 3.5M15 7H8a4.5 4.5 0 0 0 0 8h3",
  back: "M10.5 3.5 5 9l5.5 5.5",
  theme: "M9 2.5a6.5 6.5 0 1 0 0 13 6.5 6.5 0 0 0 0-13zM9 2.5a6.5 6.5 0 0 1 0 13z",
  keys: "M1.5 4h15v10h-15zM4.5 7h.01M7.5 7h.01M10.5 7h.01M13.5 7h.01M5.5 11h7",
  out: "M9 2.5v8M5.7 7.3 9 10.600l3.3-3.3M2.5 12.500v3h13v-3",
  in: "M8 3.500a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9zM11.3 11.3 15 15M6 8h4M8 6v4",
  away: "M8 3.500a4.5 4.5 0 1 0 0 9 4.5 4.5 0 0 0 0-9zM11.3 11.3 15 15M6 8h4",
  whole: "M2 9h14M4.5 6 2 9l2.5 3M13.5 6 16 9l-2.5 3",
  plus: "M9 4v10M4 9h10",
  cross: "M5 5l8 8M13 5l-8 8",
  spectrum: "M3 15V9M6 15V5M9 15v-4M12 15V3M15 15V8",
  microphone: "M9 2.500a2 2 0 0 0-2 2v4a2 2 0 0 0 4 0v-4a2 2 0 0 0-2-2zM4.5 8.500a4.5 4.5 0 0 0 9 0M9 13v2.5",
  file: "M4.5 2.500h6l3 3v10h-9zM10.5 2.500v3h3",
  text: "M3.5 4.500h11M3.5 8h11M3.5 11.500h7",
};

export type IconName = keyof typeof PATHS;

export function Icon({ name }: { name: IconName }) {
  const solid = name === "play" || name === "pause";
  return <svg class={solid ? "solid" : ""} viewBox="0 0 18 18" aria-hidden="true"><path d={PATHS[name]} /></svg>;
}
