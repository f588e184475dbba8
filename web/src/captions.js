// Words that are known, a line at a time; the one that is said is marked.

const LETTERS_MAX = 42, PAUSE_S = 0.7, EARLY_S = 0.15, LATE_S = 0.6;

function linesOf(words) {
  const lines = [];
  let line = [], letters = 0;
  words.forEach((word, index) => {
    line.push(word);
    letters += word[2].length + word[3].length;
    const next = words[index + 1];
    const ends = !next || next[0] - word[1] > PAUSE_S || /[.!?…。！？]["')\]」』]*$/.test(word[2]);
    if (ends || letters + next[2].length > LETTERS_MAX) {
      lines.push(line);
      line = []; letters = 0;
    }
  });
  return lines;
}

export class Captions {
  constructor(room, words) {
    this.room = room;
    this.lines = linesOf(words);
    this.line = null;
    this.spans = [];
  }

  show(time) {
    let line = null;
    this.lines.forEach((each, index) => {
      const next = this.lines[index + 1];
      const end = Math.min(each.at(-1)[1] + LATE_S, next ? next[0][0] - EARLY_S : Infinity);
      if (time >= each[0][0] - EARLY_S && time < end) line = each;
    });
    if (line !== this.line) this.draw(line);
    this.spans.forEach(([element, start, end]) => {
      element.classList.toggle("said", time >= start && time < end);
    });
  }

  draw(line) {
    this.line = line;
    this.spans = [];
    this.room.replaceChildren();
    if (!line) return;
    const box = document.createElement("span");
    line.forEach(([start, end, text, space], index) => {
      const word = document.createElement("b");
      word.textContent = text;
      if (index) box.append(space);
      box.append(word);
      this.spans.push([word, start, end]);
    });
    this.room.append(box);
  }
}
