// What a button without words does, told beside it while it is pointed at or focused, with its key.

const WORDLESS = ".icon, summary, #speed, #volume";
const GAP_PX = 8; // from the button, and at least from the sides of the window

export class Hints {
  constructor(room) {
    this.room = room;
    const on = (kinds, does) => kinds.forEach((kind) => addEventListener(kind, does));
    on(["pointerover", "focusin"], ({ type, target }) => {
      const button = target.closest?.(WORDLESS);
      if (button && (type === "pointerover" || button.matches(":focus-visible"))) this.show(button);
    });
    on(["pointerout", "focusout", "click", "resize"], () => this.hide());
    on(["keydown"], ({ code }) => { if (code === "Escape") this.hide(); });
  }

  hide() {
    this.room.classList.remove("shown");
  }

  show(button) {
    if (button.matches("[open] > summary")) return;
    const key = document.createElement("kbd");
    key.textContent = button.getAttribute("aria-keyshortcuts");
    this.room.replaceChildren(button.getAttribute("aria-label"), key);
    const { left, width, top } = button.getBoundingClientRect();
    const { offsetWidth: wide, offsetHeight: high } = this.room;
    const last = document.documentElement.clientWidth - wide - GAP_PX;
    this.room.style.left = `${Math.max(GAP_PX, Math.min(left + (width - wide) / 2, last))}px`;
    this.room.style.top = `${top - high - GAP_PX}px`;
    this.room.classList.add("shown");
  }
}
