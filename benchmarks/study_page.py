"""Picture against sound in a study's page: flashes as they are drawn, beeps as they are heard.

    python -m benchmarks.study_page [--plays 20]

A study of videos that flash and beep at once is served and played in Chromium. Its drawing is read
back after every picture, and its sound goes through a Web Audio worklet that finds where beeps
begin; both are put on the page's clock, and pictures that the browser left out are counted apart.
Nothing of the page's own measure is used. Web Audio plays later than the browser would by itself;
by how much, it says itself, and both figures are printed.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np

from elocute.study.stimuli.stimuli import make_stimuli
from tests.study.participant import Participant
from tests.study.studies import FLASHES_S, FPS, HEAD, QUICK, SECONDS, VIDEOS, served, two_folders
from tests.support.browser import headless_browser

WORKLET = """
registerProcessor('onsets', class extends AudioWorkletProcessor {
    process([input]) {
        const samples = input[0] ?? [];
        for (let at = 0; at < samples.length; at += 1) {
            const loud = Math.abs(samples[at]) > 0.05;
            if (loud && !(this.quiet > 0)) this.port.postMessage(currentTime + at / sampleRate);
            this.quiet = loud ? 2000 : this.quiet - 1;
        }
        return true;
    }
});
"""
HOOK = """
window.flashes = [[], []]; window.beeps = []; window.white = [false, false];
const draw = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (...given) {
    draw.apply(this, given);
    const side = [...document.querySelectorAll('canvas')].indexOf(this.canvas);
    if (side < 0) return;
    const white = Math.min(...this.getImageData(32, 32, 1, 1).data) > 200;
    // What is drawn now is shown with the next frame of the screen.
    if (white && !window.white[side]) {
        const media = window.media;
        requestAnimationFrame(() => window.flashes[side].push([performance.now(), media]));
    }
    window.white[side] = white;
};
const next = HTMLVideoElement.prototype.requestVideoFrameCallback;
HTMLVideoElement.prototype.requestVideoFrameCallback = function (told) {
    return next.call(this, (now, shown) => { window.media = shown.mediaTime; told(now, shown); });
};
const play = HTMLMediaElement.prototype.play;
HTMLMediaElement.prototype.play = async function () {
    if (!this.routed) {
        this.routed = true;
        const context = new AudioContext({latencyHint: 'interactive'});
        const code = URL.createObjectURL(new Blob([WORKLET], {type: 'text/javascript'}));
        await context.audioWorklet.addModule(code);
        const node = new AudioWorkletNode(context, 'onsets');
        const source = context.createMediaElementSource(this);
        source.connect(node);
        source.connect(context.destination);
        node.port.onmessage = ({data}) => {
            const known = context.getOutputTimestamp();
            window.routing = (context.baseLatency + context.outputLatency) * 1000;
            window.beeps.push(known.performanceTime + (data - known.contextTime) * 1000);
        };
        await context.resume();
    }
    return play.call(this);
};
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--plays", type=int, default=20)
    plays = parser.parse_args().plays
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        two_folders(folder)
        (folder / "study.toml").write_text(HEAD + VIDEOS + QUICK, encoding="utf-8")
        make_stimuli(folder / "study.toml", folder / "study")
        with (
            served(folder / "study") as host,
            headless_browser(_needed, folder / "profile", "1000,900") as driver,
        ):
            hook = HOOK.replace("WORKLET]", f"`{WORKLET}`]")
            driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": hook})
            driver.execute_cdp_cmd("Page.setBypassCSP", {"enabled": True})
            person = Participant(driver, host)
            person.begin()
            apart, sides, missed, routing = [], [], 0, []
            for _ in range(plays):
                person.run("window.flashes = [[], []]; window.beeps = []")
                person.click(".stage + .row button")
                person.until("document.querySelector('video').ended")
                person.until("window.beeps.length >= 2")
                left, right, beeps = person.run("return [...window.flashes, window.beeps]")
                routing.append(person.run("return window.routing"))
                missed += 2 - min(len(left), 2)
                for at, media in left:
                    place = int(np.abs(np.array(FLASHES_S) - media).argmin())
                    apart.append(at - beeps[place] - (media - FLASHES_S[place]) * 1000)
                sides += [abs(a[0] - b[0]) for a, b in zip(left, right, strict=True)]
            quality = "document.querySelector('video').getVideoPlaybackQuality()"
            lost = person.run(f"return {quality}.droppedVideoFrames")
    frame = 1000 / FPS
    later = np.array(apart)
    print(f"{len(later)} flashes in {plays} plays, {missed} not drawn, a frame is {frame:.0f} ms")
    print(f"pictures that the browser left out: {lost} of {round(plays * SECONDS * FPS)}")
    print(f"sides: apart at most {max(sides):.3f} ms on the clock of the screen's frames")
    print(
        f"picture after sound: median {np.median(later):.1f} ms, "
        f"5 to 95 % {np.percentile(later, 5):.1f} to {np.percentile(later, 95):.1f}, "
        f"worst {later[np.abs(later).argmax()]:.1f}"
    )
    print(f"within a frame: {(np.abs(later) < frame).mean():.1%}")
    added = float(np.median(routing))
    direct = later + added
    print(
        f"Web Audio, through which it is measured, makes sound later by {added:.1f} ms by its own "
        f"account; without that: median {np.median(direct):.1f}, 5 to 95 % "
        f"{np.percentile(direct, 5):.1f} to {np.percentile(direct, 95):.1f} ms, within a frame "
        f"{(np.abs(direct) < frame).mean():.1%}"
    )


def _needed(there: object, what: str) -> None:
    if not there:
        raise SystemExit(f"needs {what}")


if __name__ == "__main__":
    main()
