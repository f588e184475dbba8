// The checks of screen and headphones. They tell people what to change; nobody is shut out by ear.
//
// Headphones: of three tones one is quieter and one is in opposite phase on both sides, which over
// loudspeakers cancels and sounds quieter still (Woods et al. 2017).

const ROUNDS = 3;
const RIGHT = 2;
const TONE_HZ = 200;
const TONE_S = 0.8;
const GAP_S = 0.35;
const QUIETER = 10 ** (-6 / 20);
const SQUARES = 8;

export async function checkScreen(ui, width) {
  const found = {};
  await new Promise((resolve) => {
    const warning = ui.element("p", ui.text("screen_small"), "warning");
    const squares = ui.element("div", "", "squares");
    squares.setAttribute("aria-hidden", "true");
    for (let count = 0; count < SQUARES; count += 1) squares.append(document.createElement("span"));
    const select = document.createElement("select");
    select.id = "greys";
    select.append(new Option("–", ""));
    for (let count = 1; count <= SQUARES; count += 1) {
      select.append(new Option(ui.text("squares", { count }), String(count)));
    }
    const label = ui.element("label", ui.text("screen_text"));
    label.htmlFor = "greys";
    const on = ui.button("go_on", () => {
      window.removeEventListener("resize", fit);
      found.greys = Number(select.value) || 0;
      found.width = Math.min(100000, window.innerWidth);
      found.height = Math.min(100000, window.innerHeight);
      resolve();
    }, "main");
    const fit = () => {
      warning.hidden = window.innerWidth >= width;
      on.disabled = !warning.hidden || !select.value;
    };
    select.addEventListener("change", fit);
    window.addEventListener("resize", fit);
    const paragraph = document.createElement("p");
    paragraph.append(label);
    ui.page("screen_title", [warning, squares, paragraph, ui.row(select), ui.row(on)]);
    fit();
  });
  return found;
}

export async function checkHeadphones(ui) {
  const sound = new AudioContext();
  await new Promise((resolve) => {
    const on = ui.button("go_on", resolve, "main");
    on.disabled = true;
    const play = ui.button("sound_play", async () => {
      await playTones(sound, [tone(sound, 1, 1)]);
      on.disabled = false;
    });
    ui.page("sound_title", [ui.element("p", ui.text("sound_text")), ui.row(play, on)]);
  });
  let right;
  for (;;) {
    right = 0;
    for (let round = 1; round <= ROUNDS; round += 1) right += await askTones(ui, sound, round);
    if (right >= RIGHT || !(await offerAgain(ui))) break;
  }
  await sound.close();
  return { tones: right };
}

function tone(sound, gain, phase) {
  const length = Math.round(TONE_S * sound.sampleRate);
  const buffer = sound.createBuffer(2, length, sound.sampleRate);
  const edge = 0.05 * sound.sampleRate;
  for (let side = 0; side < 2; side += 1) {
    const samples = buffer.getChannelData(side);
    for (let at = 0; at < length; at += 1) {
      const swell = Math.min(1, at / edge, (length - at) / edge);
      const wave = Math.sin((2 * Math.PI * TONE_HZ * at) / sound.sampleRate);
      samples[at] = 0.35 * gain * swell * wave * (side ? phase : 1);
    }
  }
  return buffer;
}

async function playTones(sound, buffers) {
  await sound.resume();
  let at = sound.currentTime + 0.05;
  await new Promise((resolve) => {
    buffers.forEach((buffer, place) => {
      const source = sound.createBufferSource();
      source.buffer = buffer;
      source.connect(sound.destination);
      source.start(at);
      at += TONE_S + GAP_S;
      if (place === buffers.length - 1) source.addEventListener("ended", resolve);
    });
  });
}

function shuffled(items) {
  return items
    .map((item) => [Math.random(), item])
    .sort((a, b) => a[0] - b[0])
    .map(([, item]) => item);
}

/** One round; 1 where the quietest was found, else 0. */
function askTones(ui, sound, round) {
  const order = shuffled(["loud", "quiet", "turned"]);
  const kinds = { loud: [1, 1], quiet: [QUIETER, 1], turned: [1, -1] };
  return new Promise((resolve) => {
    const choices = ui.choices("tone", order.map((_, place) => ({
      value: String(place),
      label: ui.text("tone", { number: place + 1 }),
    })), () => { on.disabled = false; });
    choices.disabled = true;
    const on = ui.button("go_on", () => {
      const chosen = choices.querySelector("input:checked");
      if (chosen) resolve(order[Number(chosen.value)] === "quiet" ? 1 : 0);
    }, "main");
    on.disabled = true;
    const play = ui.button("tones_play", async () => {
      play.disabled = true;
      await playTones(sound, order.map((name) => tone(sound, ...kinds[name])));
      play.disabled = false;
      choices.disabled = false;
    });
    const told = ui.element("p", ui.text("tones_text", { round, rounds: ROUNDS }));
    ui.page("tones_title", [told, ui.row(play), choices, ui.row(on)]);
  });
}

/** Whether somebody wants to try again. */
function offerAgain(ui) {
  return new Promise((resolve) => {
    ui.page("sound_title", [
      ui.element("p", ui.text("tones_failed")),
      ui.row(
        ui.button("again", () => resolve(true), "main"),
        ui.button("all_the_same", () => resolve(false)),
      ),
    ]);
  });
}
