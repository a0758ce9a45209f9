// Search from disk: a page opened as a file may not start a Worker, so its script runs in a hidden frame.
if (location.protocol === "file:") {
  window.IFrameWorker = window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      this.inside = frame.contentWindow;
      this.loaded = new Promise((resolve) => frame.addEventListener("load", resolve));
      this.inside.document.open();
      this.inside.document.write(`<body><script src="${new URL(url, location)}"></script></body>`);
      this.inside.document.close();
      this.inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
    }

    postMessage(data) {
      const event = new this.inside.MessageEvent("message", { data });
      this.loaded.then(() => this.inside.dispatchEvent(event));
    }
  };
}
