// Pictures on canvases, drawn anew when what they show changes.
import { signal, useSignalEffect } from "@preact/signals";
import { useRef } from "preact/hooks";
import { wide } from "./scale";

export type Draw = (pen: CanvasRenderingContext2D, width: number, height: number, ink: (name: string) => string) => void;

export const theme = signal(0); // counts changes of colours

export function watchTheme() {
  new MutationObserver(() => { theme.value += 1; }).observe(document.documentElement, { attributeFilter: ["data-theme"] });
}

// draw: reads signals; each change of one draws anew.
export function Drawing({ draw, height, label }: { draw: Draw; height: number; label: string }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  useSignalEffect(() => {
    const at = canvas.current, width = wide.value;
    void theme.value;
    if (!at) return;
    const dense = Math.min(devicePixelRatio, 2);
    at.width = Math.round(width * dense);
    at.height = Math.round(height * dense);
    const pen = at.getContext("2d");
    if (!pen) return;
    pen.scale(dense, dense);
    const style = getComputedStyle(document.documentElement);
    draw(pen, width, height, (name) => style.getPropertyValue(`--${name}`));
  });
  return <canvas ref={canvas} style={{ width: "100%", height: `${height}px` }} role="img" aria-label={label} />;
}
