// What stands beside the head: what is chosen on the timeline, the take, the text, the character.
import { signal } from "@preact/signals";
import type { ComponentChildren } from "preact";
import { type Edit, isOpenMark, keysOf, laneOf, REST, spanOf, type Tier, withSetting, withSpan } from "./project";
import { type Does, type Report, server } from "./server";
import { change, compute, duration, held, known, project, saved, selection, showing, styles, told, transcribe, trouble } from "./studio";
import { doTo, kindOf, labelsOf, reEdit, removeBlink, setKey, TITLES } from "./timeline";

// ---- fields

interface Named { label: string; children: ComponentChildren }
const Field = ({ label, children }: Named) => <label class="field"><span>{label}</span>{children}</label>;

interface NumberProps { label: string; value: number; least?: number; most?: number; step?: number; unit?: string; set: (value: number) => void }

function NumberField({ label, value, least = 0, most, step = 0.01, unit, set }: NumberProps) {
  return (
    <Field label={unit ? `${label} (${unit})` : label}>
      <input type="number" value={Number(value.toFixed(3))} min={least} max={most} step={step} onChange={({ currentTarget }) => {
        const given = currentTarget.valueAsNumber;
        if (Number.isFinite(given)) set(Math.min(Math.max(given, least), most ?? Infinity));
        else currentTarget.value = String(value);
      }} />
    </Field>
  );
}

function Slider({ label, value, least = 0, most, step = 0.05, set }: NumberProps & { most: number }) {
  const at = (value - least) / (most - least);
  return (
    <label class="field slide">
      <span>{label}</span>
      <input type="range" value={value} min={least} max={most} step={step} style={{ "--at": at }}
        onInput={({ currentTarget }) => {
          currentTarget.style.setProperty("--at", String((currentTarget.valueAsNumber - least) / (most - least)));
          currentTarget.nextElementSibling!.textContent = currentTarget.value;
        }}
        onChange={({ currentTarget }) => set(currentTarget.valueAsNumber)} />
      <output>{Number(value.toFixed(2))}</output>
    </label>
  );
}

interface ChoiceProps { label: string; value: string; choices: string[]; set: (value: string) => void; id?: string }

function Choice({ label, value, choices, set, id }: ChoiceProps) {
  const all = choices.includes(value) ? choices : [value, ...choices];
  return (
    <Field label={label}>
      <select id={id} value={value} onChange={({ currentTarget }) => set(currentTarget.value)}>
        {all.map((each) => <option key={each} value={each}>{each}</option>)}
      </select>
    </Field>
  );
}

// ---- what is chosen

const GROUPS: [string, string][] = [
  ["vowel", "Vowels"], ["shut", "Lips shut"], ["teeth", "Lip at teeth"], ["consonant", "Other consonants"],
];

function LabelEditor({ tier, index }: { tier: Tier; index: number }) {
  const labels = labelsOf(tier), label = labels[index];
  if (!label) return null;
  const [start, end, text] = label;
  const all = [...new Set([...(known.value?.phones ?? []), text])].filter((each) => each !== REST);
  return (
    <>
      {tier === "phones" ? (
        <Field label="Symbol">
          <select id="field" value={text} onChange={({ currentTarget }) => doTo.text(tier, index, currentTarget.value)}>
            {GROUPS.map(([kind, title]) => (
              <optgroup key={kind} label={title}>
                {all.filter((each) => kindOf(each) === kind).map((each) => <option key={each}>{each}</option>)}
              </optgroup>
            ))}
          </select>
        </Field>
      ) : (
        <Field label="Word"><input id="field" type="text" value={text} onChange={({ currentTarget }) => doTo.text(tier, index, currentTarget.value)} /></Field>
      )}
      <div class="pair">
        <NumberField label="From" unit="s" value={start} most={end} set={(value) => doTo.bound(tier, index, 0, value)} />
        <NumberField label="To" unit="s" value={end} most={duration.value} set={(value) => doTo.bound(tier, index, 1, value)} />
      </div>
      <div class="keys">
        <button type="button" aria-keyshortcuts="S" onClick={() => doTo.split(tier, index)}>Split</button>
        <button type="button" aria-keyshortcuts="J" disabled={!labels[index + 1]} onClick={() => doTo.join(tier, index)}>Join with next</button>
        <button type="button" aria-keyshortcuts="Delete" onClick={() => doTo.remove(tier, index)}>Remove</button>
      </div>
    </>
  );
}

const REGIONS = ["jaw", "lips", "brows", "eyes", "cheeks", "head"];

function strengthOf(text: string): [string, number] {
  const [feeling, amount] = text.split(":");
  return [feeling, amount === undefined ? 1 : Number(amount)];
}
const withStrength = (feeling: string, amount: number) => (amount === 1 ? feeling : `${feeling}:${amount}`);

function MoodFields({ mood, set, id }: { mood: string; set: (mood: string) => void; id?: string }) {
  const [feeling, amount] = strengthOf(mood);
  const plain = feeling === "neutral" || feeling === "auto";
  return (
    <>
      <Choice id={id} label="Mood" value={feeling} choices={known.value?.moods ?? []} set={(value) => set(withStrength(value, value === "neutral" || value === "auto" ? 1 : amount))} />
      {!plain && <Slider label="Intensity" value={amount} most={1} set={(value) => set(withStrength(feeling, value))} />}
    </>
  );
}

// One style, or a mix of two.
function StyleFields({ style, set, id }: { style: string; set: (style: string) => void; id?: string }) {
  const [one, two] = style.split(",").map(strengthOf);
  const names = styles.value;
  const share = two ? two[1] / (one[1] + two[1]) : 0;
  const mix = (first: string, second: string, of: number) =>
    set(of <= 0 ? first : `${first}:${Number((1 - of).toFixed(2))},${second}:${Number(of.toFixed(2))}`);
  return (
    <>
      <div class="pair">
      <Choice id={id} label="Style" value={one[0]} choices={names} set={(value) => (two ? mix(value, two[0], share) : set(value))} />
      <Choice label="Mixed with" value={two ? two[0] : "nothing"} choices={["nothing", ...names.filter((each) => each !== one[0])]}
        set={(value) => (value === "nothing" ? set(one[0]) : mix(one[0], value, share || 0.5))} />
      </div>
      {two && <Slider label={`Share of ${two[0]}`} value={share} least={0.05} most={0.95} set={(value) => mix(one[0], two[0], value)} />}
    </>
  );
}

function EditEditor({ index }: { index: number }) {
  const edit = project.value?.edits[index];
  if (!edit) return null;
  const [start, end] = spanOf(edit, duration.value);
  const put = (more: Record<string, unknown>) => reEdit(index, { ...edit, ...more } as Edit);
  const keys = edit.keys as [number, never][] | undefined;
  const regions = (edit.regions ?? {}) as Record<string, number>;
  return (
    <>
      {edit.edit === "mood" && <MoodFields id="field" mood={String(edit.mood)} set={(mood) => put({ mood })} />}
      {edit.edit === "style" && <StyleFields id="field" style={String(edit.style)} set={(style) => put({ style })} />}
      {edit.edit === "amplitude" && REGIONS.map((part) => (
        <Slider key={part} label={part} value={regions[part] ?? 1} most={3} set={(value) => {
          const next = { ...regions, [part]: value };
          if (value === 1 && Object.keys(next).length > 1) delete next[part];
          put({ regions: next });
        }} />
      ))}
      {edit.edit === "gaze" && keys?.length === 1 && [0, 1].map((axis) => {
        const [[time, angles]] = keys as unknown as [number, number[]][];
        return <Slider key={axis} label={axis ? "Left (°)" : "Down (°)"} value={angles[axis]} least={-30} most={30} step={1}
          set={(value) => put({ keys: [[time, angles.map((each, place) => (place === axis ? value : each))]] })} />;
      })}
      {isOpenMark(edit) && keys && <Slider label="How far open" value={keys[0][1]} least={0.05} most={1} set={(value) => put({ keys: [[keys[0][0], value]] })} />}
      {edit.edit === "closed" && <p class="dim">The lips are sealed from the first moment to the last, whatever is said.</p>}
      <div class="pair">
        <NumberField label="From" unit="s" value={start} most={end} set={(value) => reEdit(index, withSpan(edit, value, end))} />
        <NumberField label="To" unit="s" value={end} most={duration.value} set={(value) => reEdit(index, withSpan(edit, start, value))} />
      </div>
      <div class="keys">
        {(edit.edit === "closed" || isOpenMark(edit)) && (
          <button type="button" onClick={() => reEdit(index, withSpan(edit.edit === "closed"
            ? { edit: "curve", curve: "jawOpen", keys: [[start, 0.25]], mode: "add", contacts: "free" }
            : { edit: "closed" }, start, end))}>
            {edit.edit === "closed" ? "Open instead" : "Shut instead"}
          </button>
        )}
        <button type="button" aria-keyshortcuts="Delete" onClick={() => reEdit(index, null)}>Remove</button>
      </div>
    </>
  );
}

function KeyEditor({ curve, index }: { curve: string; index: number }) {
  const key = project.value && keysOf(project.value, curve, duration.value)[index];
  if (!key) return null;
  const [time, value] = key;
  return (
    <>
      <Slider label={curve} value={value} most={1} step={0.01} set={(to) => setKey(curve, index, [time, to])} />
      <NumberField label="At" unit="s" value={time} most={duration.value} set={(to) => setKey(curve, index, [to, value])} />
      <div class="keys"><button type="button" aria-keyshortcuts="Delete" onClick={() => setKey(curve, index, null)}>Remove</button></div>
    </>
  );
}

function spanTitle(edit: Edit | undefined) {
  const lane = edit && laneOf(edit);
  return lane && lane !== "curve" ? `${TITLES[lane]} over time` : "Edit";
}

function Chosen() {
  const which = selection.value;
  if (!which || showing.value === "A") return null;
  const title = which.kind === "phones" ? "Phone" : which.kind === "words" ? "Word" : which.kind === "blink" ? "Blink"
    : which.kind === "key" ? "Key" : spanTitle(project.value?.edits[which.index]);
  return (
    <section class="chosen" aria-label="What is chosen">
      <h2>{title}</h2>
      {(which.kind === "phones" || which.kind === "words") && <LabelEditor tier={which.kind} index={which.index} />}
      {which.kind === "edit" && <EditEditor index={which.index} />}
      {which.kind === "key" && <KeyEditor curve={which.curve} index={which.index} />}
      {which.kind === "blink" && (
        <>
          <p class="dim">At {which.time.toFixed(2)} s, {which.made ? "put in by you" : "as the take has it"}.</p>
          <div class="keys"><button type="button" aria-keyshortcuts="Delete" onClick={() => removeBlink(which.time, which.made)}>Remove</button></div>
        </>
      )}
    </section>
  );
}

// ---- the take

export function setTake(setting: string, value: unknown) {
  if (saved.value) change(withSetting(saved.value, setting, value));
}

// Those of the file that have no lane.
function OtherEdits() {
  const edits = project.value?.edits ?? [];
  const others = edits.map((edit, index) => ({ edit, index })).filter(({ edit }) => laneOf(edit) === null && edit.edit !== "blinks");
  return others.length > 0 && (
    <>
      <h2 class="others">Other edits</h2>
      <ul>
        {others.map(({ edit, index }) => (
          <li key={index} class="pair"><span>{edit.edit}</span><button type="button" aria-label={`Remove ${edit.edit}`} onClick={() => reEdit(index, null)}>Remove</button></li>
        ))}
      </ul>
    </>
  );
}

function Settings() {
  const here = project.value, can = known.value;
  if (!here || !can) return null;
  const told = (setting: string) => can.settings.find((each) => each.name === setting);
  const value = (setting: string) => (here.settings[setting] ?? told(setting)?.default) as never;
  const light = String(here.options?.light ?? "studio"), seed = Number(value("seed"));
  const model = (to: string) => {
    if (!saved.value) return;
    const { styles: able } = can.models[to] ?? { styles: [] };
    const next = withSetting(saved.value, "model", to), style = next.settings.style;
    change(style === undefined || able.includes(String(style)) ? next : withSetting(next, "style", undefined));
  };
  return (
    <fieldset disabled={showing.value === "A"} class="settings">
      <legend class="unseen">The take</legend>
      <Choice label="Model" value={value("model")} choices={Object.keys(can.models)} set={model} />
      {styles.value.length > 0 && <StyleFields style={value("style")} set={(style) => setTake("style", style)} />}
      <Slider label="Strength" value={Number(value("strength"))} most={told("strength")?.high ?? 2} set={(to) => setTake("strength", to)} />
      <MoodFields mood={value("mood")} set={(mood) => setTake("mood", mood)} />
      <Slider label="Life" value={Number(value("life"))} most={1} set={(to) => setTake("life", to)} />
      {!here.character && (
        <>
          <Choice label="Face" value={String(value("identity"))} choices={can.identities} set={(to) => setTake("identity", to)} />
          <Choice label="Look" value={String(value("look"))} choices={can.looks} set={(to) => setTake("look", to)} />
        </>
      )}
      <Choice label="Light" value={light} choices={can.lights} set={(to) => saved.value && change({ ...saved.value, options: { ...saved.value.options, light: to } })} />
      <button type="button" onClick={() => setTake("seed", seed + 1)}>Other blinks, looks and nods</button>
      <OtherEdits />
    </fieldset>
  );
}

function Text() {
  const here = project.value;
  if (!here) return null;
  return (
    <fieldset disabled={showing.value === "A"} class="settings">
      <legend class="unseen">The text</legend>
      <label class="field">
        <span>What is said</span>
        <textarea rows={4} value={here.text ?? ""} placeholder="With its text, words and phones are found in the sound." onChange={({ currentTarget }) => {
          const text = currentTarget.value.trim() || null;
          if (saved.value && text !== saved.value.text) change({ ...saved.value, text, words: null, phones: null });
        }} />
      </label>
      <Field label="Language"><input type="text" value={here.language ?? ""} placeholder="as heard" spellcheck={false} onChange={({ currentTarget }) => {
        const language = currentTarget.value.trim() || null;
        if (saved.value && language !== saved.value.language) change({ ...saved.value, language, words: null, phones: null });
      }} /></Field>
      {known.value?.extras.transcribe && <button type="button" onClick={transcribe}>Write down what is heard</button>}
      {here.phones && <p class="dim">Phones were moved by hand. <button type="button" onClick={() => saved.value && change({ ...saved.value, phones: null, words: null })}>Find them again</button></p>}
    </fieldset>
  );
}

// ---- the character

export const report = signal<Report | null>(null);

export async function dress(file: File) {
  try {
    const found = await server.addCharacter(file, file.name);
    report.value = { ...NOTHING, ...found };
    if (saved.value) change({ ...saved.value, character: found.name });
  } catch (error) {
    told(error);
  }
}

const NOTHING: Omit<Report, "name"> = { mapped: {}, fitted: {}, idle: {}, unknown: {}, names: {}, missing: [], notes: [] };
const LISTS: [keyof Report, string][] = [
  ["mapped", "Mapped"], ["fitted", "Fitted to the mouth"], ["idle", "Idle"], ["missing", "Not there"],
];
const UNSAID = "not known", ALONE = "left alone";
const wordOf = (does: Does | undefined) =>
  (does === undefined ? UNSAID : does === null ? ALONE : typeof does === "string" ? does : Object.entries(does).map(([curve, share]) => `${share} ${curve}`).join(" + "));

// Say what a shape does; it is kept beside the character, for every take of it.
async function nameShape(shape: string, word: string) {
  const found = report.value;
  if (!found) return;
  const { [shape]: _, ...names } = found.names;
  if (word !== UNSAID) names[shape] = word === ALONE ? null : word;
  try {
    report.value = { ...NOTHING, ...await server.nameShapes(found.name, names) };
    trouble.value = null;
    await compute();
  } catch (error) {
    told(error);
  }
}

// Shapes whose names say nothing, and what they do: chosen here.
function Shapes({ title, shapes, found }: { title: string; shapes: string[]; found: Report }) {
  const choices = [UNSAID, ALONE, ...known.value?.shapes ?? []];
  return shapes.length > 0 && (
    <details open>
      <summary>{title} <small>{shapes.length}</small></summary>
      {shapes.map((shape) => (
        <Choice key={shape} label={found.unknown[shape] ? `${shape} (near ${found.unknown[shape]})` : shape}
          value={wordOf(found.names[shape])} choices={choices} set={(word) => nameShape(shape, word)} />
      ))}
    </details>
  );
}

const rowsOf = (list: string[] | Record<string, string>) =>
  (Array.isArray(list) ? list : Object.entries(list ?? {}).map(([own, takes]) => `${own}: ${takes}`));

function Character() {
  const here = project.value, found = report.value;
  if (!here) return null;
  if (here.character && found?.name !== here.character) {
    const { character } = here;
    report.value = { ...NOTHING, name: character };
    server.character(character).then((record) => { report.value = { ...NOTHING, ...record }; }).catch(told);
  }
  return (
    <div class="settings">
      <p>{here.character ?? "The built-in head"}</p>
      <div class="keys">
        <label class="button">Own character…<input class="unseen" type="file" accept={[...(known.value?.characters ?? []), ".obj", ".ply", ".stl"].join()} onChange={({ currentTarget }) => { if (currentTarget.files?.[0]) dress(currentTarget.files[0]); currentTarget.value = ""; }} /></label>
        {here.character && <button type="button" onClick={() => { report.value = null; if (saved.value) change({ ...saved.value, character: null }); }}>Built-in head</button>}
      </div>
      {found && here.character && (
        <>
          {found.notes.map((note) => <p key={note}>{note}</p>)}
          <Shapes title="Not known" shapes={Object.keys(found.unknown)} found={found} />
          <Shapes title="As you say" shapes={Object.keys(found.names)} found={found} />
        </>
      )}
      {found && here.character && LISTS.map(([key, title]) => {
        const rows = rowsOf(found[key] as string[] | Record<string, string>);
        return rows.length > 0 && (
          <details key={key}>
            <summary>{title} <small>{rows.length}</small></summary>
            <ul>{rows.map((row) => <li key={row}>{row}</li>)}</ul>
          </details>
        );
      })}
    </div>
  );
}

const open = signal("take");
const TABS: [string, string][] = [["take", "Take"], ["text", "Text"], ["character", "Character"]];

export function Panel() {
  const move = (event: KeyboardEvent) => {
    const way = Number(event.code === "ArrowRight") - Number(event.code === "ArrowLeft");
    if (!way) return;
    const at = TABS.findIndex(([id]) => id === open.value);
    open.value = TABS[(at + way + TABS.length) % TABS.length][0];
    document.getElementById(`tab-${open.value}`)?.focus();
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <aside class="panel" aria-label="Settings">
      <Chosen />
      <div role="tablist" class="tabs" aria-label="Settings" onKeyDown={move}>
        {TABS.map(([id, title]) => (
          <button key={id} id={`tab-${id}`} type="button" role="tab" aria-selected={open.value === id} aria-controls="tab" tabIndex={open.value === id ? 0 : -1} onClick={() => { open.value = id; }}>{title}</button>
        ))}
      </div>
      <div id="tab" role="tabpanel" aria-labelledby={`tab-${open.value}`}>
        {open.value === "take" && <Settings />}
        {open.value === "text" && <Text />}
        {open.value === "character" && <Character />}
        {held.value && showing.value === "A" && <p class="dim">This is A, as it was held. B is what you work on.</p>}
      </div>
    </aside>
  );
}
