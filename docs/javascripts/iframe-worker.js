// Lets search work in pages that are opened from disk: browsers start no Worker from file://, so its
// script runs in a hidden frame instead. On a server the browser's own Worker stays.
(() => {
  if (location.protocol !== "file:") return;

  class IFrameWorker extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.appendChild(frame);
      const page = frame.contentDocument;
      page.open();
      page.write("<!doctype html><head></head>");
      this.inside = frame.contentWindow;
      this.inside.postMessage = (data) =>
        this.dispatchEvent(new MessageEvent("message", { data }));
      this.inside.importScripts = (...urls) =>
        urls.reduce((before, next) => before.then(() => this.load(next)), Promise.resolve());
      this.ready = this.load(url);
      page.close();
      this.terminate = () => frame.remove();
    }

    load(url) {
      return new Promise((done, failed) => {
        const page = this.inside.document;
        const script = page.createElement("script");
        script.src = url;
        script.onload = done;
        script.onerror = failed;
        (page.head || page.documentElement || page).appendChild(script);
      });
    }

    postMessage(data) {
      this.ready.then(() =>
        this.inside.dispatchEvent(new this.inside.MessageEvent("message", { data })),
      );
    }
  }

  window.IFrameWorker = window.Worker = IFrameWorker;
})();
