// The stream of what the instrument shows, and whether it still comes.

const SILENT_MS = 2500; // the stream brings something at least each second
const LOOK_MS = 500;
const AGAIN_MS = 1000;

/**
 * Follows /api/live while the page is in view, for ever.
 *
 * A hidden page lets go of its stream: a browser keeps few connections to one host, and forgotten tabs would
 * hold up a vent. `handlers` has a function for each kind of event and `opened`, called as a stream begins;
 * `onLink({up, why})` is called when the instrument can be seen, and when it no longer can.
 */
export function follow(handlers, onLink) {
  let stream = null;
  let heard_ms = 0;
  let up = false;

  const link = (isUp, why) => {
    up = isUp;
    onLink({ up: isUp, why });
  };

  const close = (why) => {
    stream?.close();
    stream = null;
    link(false, why);
  };

  const open = () => {
    heard_ms = performance.now();
    stream = new EventSource("/api/live");
    stream.onopen = handlers.opened;
    stream.onerror = () => link(false, "the page’s own server does not answer");
    listen("link", ({ up: isUp, why }) => link(isUp, why));
    for (const kind of ["samples", "state", "contacts", "health", "event"])
      listen(kind, (data) => (up || kind === "event") && handlers[kind](data));
  };

  const listen = (kind, take) => {
    const mine = stream;
    mine.addEventListener(kind, ({ data }) => {
      if (mine !== stream) return;
      heard_ms = performance.now();
      take(JSON.parse(data));
    });
  };

  const look = () => {
    if (document.hidden) return;
    const silent_ms = performance.now() - heard_ms;
    if (!stream) open();
    else if (stream.readyState === EventSource.CLOSED && silent_ms > AGAIN_MS) close("the page’s own server does not answer"), open();
    else if (silent_ms > SILENT_MS) close("the page’s own server has fallen silent"), open();
  };

  document.addEventListener("visibilitychange", () =>
    document.hidden ? close("this page was out of view") : look(),
  );
  setInterval(look, LOOK_MS);
  look();
}
