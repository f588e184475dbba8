// The study's page. The server says what comes next; the page shows it and sends the answer.
//
// All text goes in as text, never as markup. Nothing is kept on the device but the token by which
// the server knows who comes again.

import { checkHeadphones, checkScreen } from "/checks.js";
import { Player, Videos } from "/player.js";

const KEPT = "elocute-study";
const TRIES = 6;
const FIRST_WAIT_MS = 400;
const main = document.getElementById("main");
/** @type {(id: string) => any} */
const byId = (id) => document.getElementById(id);

let about;
let texts = {};
let language = "en";
let token = null;
let busy = false;
let showing = 0;

// What is kept ----------------------------------------------------------------

function keep(value) {
  token = value;
  try {
    if (value) localStorage.setItem(KEPT, value);
    else localStorage.removeItem(KEPT);
  } catch {
    // A private window keeps nothing; the study goes on as long as the page is open.
  }
}

function kept() {
  try {
    return localStorage.getItem(KEPT);
  } catch {
    return null;
  }
}

// The server ------------------------------------------------------------------

class Told extends Error {
  constructor(status, reason) {
    super(reason);
    this.status = status;
    this.reason = reason;
  }
}

function wait(ms) {
  return new Promise((resolve) => setTimeout(resolve, ms));
}

/** Ask once. Throws Told for what the server refuses, TypeError where it is not reached. */
async function askOnce(path, body) {
  const headers = token ? { Authorization: `Bearer ${token}` } : {};
  /** @type {RequestInit} */
  const options = { headers, cache: path.startsWith("/media/") ? "default" : "no-store" };
  if (body !== undefined) {
    options.method = "POST";
    options.body = JSON.stringify(body);
    headers["Content-Type"] = "application/json";
  }
  const answer = await fetch(path, options);
  if (answer.ok) return path.startsWith("/media/") ? answer.blob() : answer.json();
  let reason = "";
  try {
    reason = (await answer.json()).error;
  } catch {
    // Not the server's own words.
  }
  throw new Told(answer.status, reason);
}

/** Ask again while the server is not reached, or cannot do it now. */
async function ask(path, body, waiting = () => {}) {
  for (let tried = 1; ; tried += 1) {
    try {
      return await askOnce(path, body);
    } catch (error) {
      const passing = !(error instanceof Told) || error.status >= 500
        || error.status === 429 || error.status === 425;
      if (!passing || tried === TRIES) throw error;
      waiting();
      await wait(FIRST_WAIT_MS * 2 ** (tried - 1));
    }
  }
}

const videos = new Videos((path) => ask(path));

// What is shown ---------------------------------------------------------------

const ui = {
  text(name, values = {}) {
    return (texts[name] ?? name).replace(/\{(\w+)\}/g, (_, key) => values[key] ?? "");
  },
  element(kind, text = "", name = "") {
    const made = document.createElement(kind);
    made.textContent = text;
    if (name) made.className = name;
    return made;
  },
  button(name, pressed, kind = "") {
    const made = ui.element("button", ui.text(name), kind);
    made.type = "button";
    made.addEventListener("click", pressed);
    return made;
  },
  row(...parts) {
    const made = ui.element("div", "", "row");
    made.append(...parts);
    return made;
  },
  /** Radio buttons; the fieldset can be disabled as a whole. */
  choices(name, offers, chosen, legend = "") {
    const made = document.createElement("fieldset");
    made.append(ui.element("legend", legend || ui.text("not_chosen"), "hidden"));
    for (const { value, label } of offers) {
      const choice = ui.element("label", "", "choice");
      const input = document.createElement("input");
      input.type = "radio";
      input.name = name;
      input.value = value;
      input.addEventListener("change", chosen);
      choice.append(input, ui.element("span", label));
      made.append(choice);
    }
    return made;
  },
  /** A page of its own: heading, focused, and what stands below it. */
  page(title, parts, kind = "text") {
    main.className = kind;
    const heading = ui.element("h1", texts[title] ?? title);
    heading.tabIndex = -1;
    main.replaceChildren(heading, ...parts);
    heading.focus({ preventScroll: true });
    window.scrollTo(0, 0);
    say("");
  },
};

function say(text) {
  byId("status").textContent = text;
}

function spoken(given) {
  return given?.[language] ?? given?.[""] ?? given?.en ?? "";
}

async function useLanguage(chosen) {
  texts = await ask(`/texts/${chosen}.json`);
  language = chosen;
  document.documentElement.lang = chosen;
  document.title = about.title;
  byId("title").textContent = about.title;
  byId("leave").textContent = ui.text("leave");
}

function end(title, text, more = []) {
  byId("place").hidden = true;
  ui.page(title, [ui.element("p", ui.text(text, about)), ...more]);
}

/** A link back to where a person came from; the browser does not say from where it leads there. */
function wayBack(address) {
  const link = ui.element("a", ui.text("go_back"), "back");
  link.href = address;
  link.rel = "noreferrer";
  return ui.row(link);
}

/** The code that a panel asks for. */
function codeParts(code) {
  const shown = ui.element("p", code, "code");
  shown.id = "code";
  return [ui.element("p", ui.text("code")), shown];
}

/** What panels call a person, the study and the visit, in whatever case. */
const PANELS = {
  id: ["prolific_pid", "workerid", "worker_id", "participantid", "participant_id", "panelid",
    "panel_id", "survey_code", "rid", "pid", "psid", "user_id", "userid"],
  study: ["study_id", "studyid", "hitid", "hit_id", "project_id", "projectid"],
  session: ["session_id", "sessionid", "assignmentid", "assignment_id"],
};

/** What a panel has left unfilled, as {{%PROLIFIC_PID%}} or [%RID%]: all would be one person. */
const UNFILLED = /[{}[\]<>]|%\w+%/;

/** Mechanical Turk's word for an assignment that nobody has accepted: the page is only looked at. */
const PREVIEW = "ASSIGNMENT_ID_NOT_AVAILABLE";

/** What the link of a panel brought, undefined where it is none. */
function panelOf(search) {
  const given = new Map();
  for (const [name, value] of new URLSearchParams(search)) {
    const shown = [...value].filter((each) => each >= " " && each !== "\u007f");
    const text = shown.join("").trim().slice(0, 200);
    if (UNFILLED.test(text)) continue;
    if (text && !given.has(name.toLowerCase())) given.set(name.toLowerCase(), text);
  }
  const own = about.panel.parameter.toLowerCase();
  const found = {};
  for (const [field, names] of Object.entries(PANELS)) {
    const name = (field === "id" && own ? [own] : names).find((each) => given.has(each));
    if (name) found[field] = given.get(name);
  }
  return found.id ? found : undefined;
}

// Before the trials -----------------------------------------------------------

function consent() {
  const link = new URLSearchParams(location.hash.slice(1)).get("link") || undefined;
  byId("leave").hidden = true;
  const panel = panelOf(location.search);
  if (about.invited && !link) return end("link", "link_text");
  const previewed = [...new URLSearchParams(location.search).values()].includes(PREVIEW);
  if (previewed || (about.panel.required && !panel && !link)) return end("panel", "panel_text");
  const paragraphs = spoken(about.about).split(/\n\s*\n/).filter((each) => each.trim());
  const parts = paragraphs.map((each) => ui.element("p", each));
  for (const name of ["minutes", "stored", ...(panel ? ["stored_id"] : []), "leaving", "contact"]) {
    parts.push(ui.element("p", ui.text(name, { ...about, ...panel })));
  }
  if (about.languages.length > 1) parts.unshift(languages());
  const agree = ui.element("label", "", "agree");
  const box = document.createElement("input");
  box.type = "checkbox";
  box.id = "agree";
  agree.append(box, ui.element("span", ui.text("agree")));
  const begin = ui.button("begin", () => once(async () => {
    // What is undefined is left out of the JSON.
    const joined = await ask("/api/join", { language, link, panel });
    keep(joined.token);
    history.replaceState(null, "", "/");
    await show(joined.step);
  }), "main");
  begin.disabled = true;
  box.addEventListener("change", () => { begin.disabled = !box.checked; });
  ui.page(about.title, [...parts, agree, ui.row(begin)]);
  return undefined;
}

function languages() {
  const label = ui.element("label", `${ui.text("choose_language")} `);
  const select = document.createElement("select");
  for (const each of about.languages) {
    const name = new Intl.DisplayNames([each], { type: "language" }).of(each);
    select.append(new Option(name, each, each === language, each === language));
  }
  select.addEventListener("change", async () => {
    await useLanguage(select.value);
    consent();
  });
  label.append(select);
  return ui.row(label);
}

async function checks() {
  const found = await checkScreen(ui, about.width);
  if (about.headphones) Object.assign(found, await checkHeadphones(ui));
  await show(await ask("/api/checks", found));
}

/** A page to be read before what follows it. */
function interlude(title, text) {
  return new Promise((resolve) => {
    ui.page(title, [ui.element("p", ui.text(text)), ui.row(ui.button("start", resolve, "main"))]);
  });
}

// Trials ----------------------------------------------------------------------

function question(trial) {
  const own = trial.kind === about.kind ? spoken(about.question) : "";
  const kind = trial.kind === "rating" ? about.scale : trial.kind;
  return own || ui.text(`question_${kind}`);
}

function labels(trial, clip, place) {
  if (clip.sides === 2 && trial.kind === "rating") return [ui.text("reference"), ui.text("this_one")];
  if (clip.sides === 2) return [ui.text("left"), ui.text("right")];
  return [trial.clips.length > 1 && place === 0 ? ui.text("first_video") : ui.text("video")];
}

function offered(trial) {
  if (trial.kind === "rating") {
    return [0, 25, 50, 75, 100].map((each) => (
      { value: String(each), label: ui.text(`scale_${each}`) }));
  }
  const named = ["left", "right", "early", "together", "late"];
  return trial.offers.map((each) => (
    { value: each, label: named.includes(each) && texts[each] ? ui.text(each) : each }));
}

/** The field of the answer: radio buttons, or a slider that has to be moved. */
function answerField(trial, chosen) {
  if (trial.kind !== "rating" || about.scale === "mos") {
    const field = ui.choices("answer", offered(trial), chosen, question(trial));
    if (trial.offers.length === 2 && trial.kind !== "intelligibility") field.className = "two";
    return { field, value: () => /** @type {HTMLInputElement | null} */ (field.querySelector("input:checked"))?.value };
  }
  const field = document.createElement("fieldset");
  const box = ui.element("div", "", "slider");
  const slider = document.createElement("input");
  Object.assign(slider, { type: "range", min: "0", max: "100", step: "1", value: "50", id: "slider" });
  slider.setAttribute("aria-label", ui.text("slider"));
  const shown = ui.element("output", "–");
  let moved = false;
  const move = () => {
    moved = true;
    shown.textContent = slider.value;
    chosen();
  };
  slider.addEventListener("input", move);
  slider.addEventListener("change", move);
  const ends = ui.element("div", "", "ends");
  ends.append(ui.element("span", ui.text("scale_0")), ui.element("span", ui.text("scale_100")));
  box.append(slider, ends, shown);
  field.append(ui.element("legend", question(trial), "hidden"), box);
  return { field, value: () => (moved ? slider.value : undefined) };
}

async function runTrial(step) {
  const { trial } = step;
  const number = (showing += 1);
  if (trial.begins) await interlude(`${trial.phase}_title`, `${trial.phase}_text`);
  if (trial.pause) await interlude("pause_title", "pause_text");
  if (number !== showing) return;
  const ids = [...trial.clips.map((each) => each.id), ...step.ahead];
  videos.keep(ids);
  const players = [];
  let firstPicture = null;
  const replays = () => players.reduce((sum, each) => sum + Math.max(0, each.plays - 1), 0);

  const answer = answerField(trial, refresh);
  answer.field.disabled = true;
  const next = ui.button("next", send, "main");
  const plays = [];
  const parts = [];
  trial.clips.forEach((clip, place) => {
    const stage = ui.element("div", "", "stage");
    if (trial.clips.length > 1) {
      stage.append(ui.element("h2", ui.text(place ? "two_videos" : "first_video")));
      stage.classList.add("small");
    }
    const player = new Player(stage, clip, labels(trial, clip, place), trial.share, refresh);
    players.push(player);
    const button = ui.button("play", () => start(place), "");
    button.disabled = true;
    plays.push(button);
    parts.push(stage, ui.row(button));
  });
  const count = trial.kind === "rating" && about.scale === "mushra" ? 0 : offered(trial).length;
  const numbers = count === 2 ? ui.text("numbers_two") : ui.text("numbers_many", { count });
  if (count) parts.push(answer.field, ui.row(next), ui.element("p", ui.text("keys", { numbers }), "keys"));
  else parts.push(answer.field, ui.row(next));
  ui.page(question(trial), parts, "trial");
  showPlace(trial);
  say(ui.text("loading"));
  refresh();
  document.onkeydown = keys;

  try {
    await Promise.all(players.map(async (player, at) => (
      player.load(await videos.url(trial.clips[at].id)))));
  } catch (error) {
    if (number !== showing) return;
    await problem(error.message === "cannot_play" ? "cannot_play" : "no_video", leaveTrial, step);
    return;
  }
  if (number !== showing) return;
  firstPicture = performance.now();
  say(ui.text("watch"));
  refresh();
  main.dataset.ready = "yes";
  plays[0].focus({ preventScroll: true });
  for (const id of step.ahead) videos.url(id).catch(() => {});

  function start(place) {
    players.forEach((each) => each.stop());
    players[place].play();
  }

  function refresh() {
    const loaded = firstPicture !== null;
    const playing = players.find((each) => each.playing);
    const watched = players.length > 0 && players.every((each) => each.watched);
    const spent = replays() >= trial.replays;
    plays.forEach((button, at) => {
      const player = players[at];
      button.textContent = ui.text(player.playing ? "playing" : player.plays ? "replay" : "play");
      const useUp = player.plays > 0 && player.watched && spent;
      button.disabled = !loaded || player.playing || useUp;
    });
    if (loaded && watched && answer.field.disabled) {
      answer.field.disabled = false;
      say(ui.text("answer_now"));
    }
    if (players.some((each) => each.failed)) say(ui.text("cannot_play"));
    next.disabled = !watched || answer.value() === undefined || Boolean(playing && !watched);
  }

  function keys(event) {
    const typing = event.target.matches?.("select, input[type=range], dialog *");
    if (event.ctrlKey || event.metaKey || event.altKey || typing) return;
    if (event.key.toLowerCase() === "p") {
      const at = Math.max(0, players.findIndex((each) => !each.watched));
      if (!plays[at].disabled) start(at);
    } else if (/^[1-9]$/.test(event.key)) {
      /** @type {NodeListOf<HTMLInputElement>} */
      const inputs = answer.field.querySelectorAll("input[type=radio]");
      const input = inputs[Number(event.key) - 1];
      if (input && !answer.field.disabled) {
        input.checked = true;
        input.focus();
        refresh();
      }
    } else if (event.key === "Enter" && !event.target.matches?.("button") && !next.disabled) {
      send();
    } else {
      return;
    }
    event.preventDefault();
  }

  function leaveTrial() {
    document.onkeydown = null;
    delete main.dataset.ready;
    players.forEach((each) => each.remove());
  }

  function send() {
    if (next.disabled) return;
    once(async () => {
      const worst = players.map((each) => each.measured)
        .reduce((a, b) => (Math.abs(b.late_ms) > Math.abs(a.late_ms) ? b : a));
      const body = {
        order: trial.order,
        answer: answer.value(),
        seconds: Math.round(performance.now() - firstPicture) / 1000,
        replays: Math.min(replays(), trial.replays),
        ...worst,
      };
      players.forEach((each) => each.stop());
      next.disabled = true;
      answer.field.disabled = true;
      say(ui.text("storing"));
      const following = await stored(body);
      leaveTrial();
      await show(following);
      if (following.state === "trial") byId("status").dataset.stored = trial.order;
    });
  }
}

/** Send an answer until it is stored; the same answer sent twice is stored once. */
async function stored(body) {
  for (;;) {
    try {
      return await ask("/api/answer", body, () => say(ui.text("not_stored")));
    } catch (error) {
      if (error instanceof Told && error.status === 409) return ask("/api/step");
      if (error instanceof Told && error.status === 401) throw error;
      await new Promise((resolve) => {
        const again = ui.button("try_again", () => {
          again.remove();
          resolve();
        }, "main");
        say(ui.text("not_stored"));
        main.append(ui.row(again));
        again.focus();
      });
    }
  }
}

function showPlace(trial) {
  byId("place").hidden = false;
  byId("progress").max = trial.total;
  byId("progress").value = trial.order - 1;
  byId("progress").setAttribute("aria-label", ui.text("count", trial));
  byId("count").textContent = ui.text("count", trial);
}

async function problem(text, before, step) {
  await new Promise((resolve) => {
    before();
    ui.page("lost", [
      ui.element("p", ui.text(text)), ui.row(ui.button("try_again", resolve, "main")),
    ]);
  });
  await show({ ...step, trial: { ...step.trial, begins: false, pause: false } });
}

// The order of things ---------------------------------------------------------

/** Run what a button asks for, once at a time; tell what goes wrong. */
async function once(work) {
  if (busy) return;
  busy = true;
  try {
    await work();
  } catch (error) {
    failed(error);
  } finally {
    busy = false;
  }
}

function failed(error) {
  if (error instanceof Told && error.status === 401) {
    keep(null);
    consent();
  } else if (error instanceof Told && ["full", "link", "panel", "again"].includes(error.reason)) {
    const { full_code: code, full_return: address } = about.panel;
    const more = error.reason === "full" && code ? codeParts(code) : [];
    end(error.reason, `${error.reason}_text`, more.length && address ? [...more, wayBack(address)] : more);
  } else {
    end("lost", "lost_text", [ui.row(ui.button("try_again", () => location.reload(), "main"))]);
  }
}

async function show(step) {
  byId("leave").hidden = !token;
  if (step.state === "checks") checks().catch(failed);
  else if (step.state === "trial") runTrial(step).catch(failed);
  else {
    const parts = step.code ? codeParts(step.code) : [];
    if (step.return_to) parts.push(wayBack(step.return_to));
    const title = step.state === "done" ? "done" : "stopped";
    end(title, `${title}_text`, parts);
  }
}

function leave() {
  const dialog = document.createElement("dialog");
  const heading = ui.element("h1", ui.text("leave_title"));
  heading.id = "leave-title";
  dialog.setAttribute("aria-labelledby", "leave-title");
  dialog.append(
    heading,
    ui.element("p", ui.text("leave_text")),
    ui.row(
      ui.button("stay", () => dialog.close(), "main"),
      ui.button("delete", () => once(async () => {
        await ask("/api/withdraw", {});
        keep(null);
        showing += 1;
        document.onkeydown = null;
        dialog.close();
        byId("leave").hidden = true;
        end("withdrawn", "withdrawn_text");
      })),
    ),
  );
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

async function open() {
  byId("leave").addEventListener("click", leave);
  about = await ask("/api/study");
  const wanted = navigator.languages.map((each) => each.slice(0, 2).toLowerCase());
  await useLanguage(wanted.find((each) => about.languages.includes(each)) ?? about.languages[0]);
  token = kept();
  // Who comes by a personal link or a panel's is who it says, whoever had this device before.
  if (new URLSearchParams(location.hash.slice(1)).get("link") || panelOf(location.search)) keep(null);
  if (!token) return consent();
  return show(await ask("/api/step"));
}

open().catch(failed);
