// Between the head and the timeline: play, speed, loop, views, zoom.
import { computed } from "@preact/signals";
import { clockText, VIEW_NAMES } from "../controls.js";
import { Tool } from "./bar";
import { Icon } from "./icons";
import { looping, now, playing, range, view } from "./player";
import { showAll, zoom } from "./scale";
import { signal } from "@preact/signals";
import { duration, thePlayer } from "./studio";
import { spectral } from "./timeline";

export const speed = signal(1);

export function setSpeed(to: number) {
  speed.value = to;
  thePlayer().sound.playbackRate = to;
}

const told = computed(() => clockText(now.value));

export function Transport() {
  const on = playing.value;
  return (
    <div class="transport" role="group" aria-label="Playback">
      <button id="play" type="button" class="icon" aria-label={on ? "Pause" : "Play"} aria-keyshortcuts="Space" onClick={() => thePlayer().toggle()}><Icon name={on ? "pause" : "play"} /></button>
      <span class="time"><span id="now">{told}</span> / {clockText(duration.value)}</span>
      <Tool icon="loop" label={range.value ? "Loop the range" : "Loop"} keys="L" pressed={looping.value} onClick={() => { looping.value = !looping.value; }} />
      <button type="button" aria-pressed={speed.value === 0.5} aria-label="Half speed" aria-keyshortcuts="H" onClick={() => setSpeed(speed.value === 0.5 ? 1 : 0.5)}>½×</button>
      <div class="views" role="group" aria-label="View">
        {Object.entries(VIEW_NAMES).map(([id, title]) => (
          <button key={id} type="button" aria-pressed={view.value === id} onClick={() => thePlayer().camera?.show(id)}>{title}</button>
        ))}
      </div>
      <div class="tools wide-only">
        <Tool icon="spectrum" label="Spectrogram" pressed={spectral.value} onClick={() => { spectral.value = !spectral.value; }} />
        <Tool icon="away" label="Zoom out" keys="Shift+ArrowDown" onClick={() => zoom(1.5)} />
        <Tool icon="in" label="Zoom in" keys="Shift+ArrowUp" onClick={() => zoom(1 / 1.5)} />
        <Tool icon="whole" label="The whole take" onClick={showAll} />
      </div>
    </div>
  );
}
