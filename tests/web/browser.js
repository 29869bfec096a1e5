// Chromium, driven by a request {"do": …} a line, each answered by a line {"came": …} or {"failed": …}.
const { readFileSync } = require("fs");
const { createInterface } = require("readline");
const { chromium } = require("playwright-core");

const AXE = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const PATIENCE_MS = 15000;
const LOOK_MS = 50;
const MOST_TOLD = 1000;
const FLAGS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];

let browser;
let page;
const requested = [];
const complaints = [];

const watch = (context) => {
  context.on("request", (request) => requested.push(request.url()));
  context.on("weberror", (error) => complaints.push(error.error().message));
  context.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
};

/** The script's value as soon as it is true; asked from here, for the page's policy lets nobody else evaluate. */
const awaited = async (script) => {
  const until_ms = Date.now() + PATIENCE_MS;
  for (;;) {
    const value = await page.evaluate(script);
    if (value) return value;
    if (Date.now() > until_ms)
      throw new Error(`still not; the page says: ${(await page.innerText("body")).slice(0, MOST_TOLD)}`);
    await page.waitForTimeout(LOOK_MS);
  }
};

const requests = {
  /** A window of its own; `without` is a script that does not arrive, `scripts: false` is a browser without any. */
  open: async ({ url, scripts = true, without }) => {
    await page?.context().close();
    const context = await browser.newContext({ javaScriptEnabled: scripts });
    context.setDefaultTimeout(PATIENCE_MS);
    watch(context);
    if (without) await context.route(`**/${without}`, (route) => route.abort());
    page = await context.newPage();
    await page.goto(url);
  },
  reload: () => page.reload().then(() => undefined),
  look: async ({ width, height, scheme = "light" }) => {
    await page.setViewportSize({ width, height });
    await page.emulateMedia({ colorScheme: scheme });
  },
  evaluate: ({ script }) => page.evaluate(script),
  wait: ({ script }) => awaited(script),
  press: ({ key }) => page.keyboard.press(key),
  click: ({ on }) => page.click(on),
  fill: ({ on, text }) => page.fill(on, text),
  text: ({ of }) => page.innerText(of),
  picture: ({ path }) => page.screenshot({ path }).then(() => undefined),
  /** What axe-core finds: [rule, impact, the first element]. */
  audit: async () => {
    const found = await page.evaluate(`${AXE}; axe.run().then(({ violations }) => violations)`);
    return found.map(({ id, impact, nodes }) => [id, impact, nodes[0].html]);
  },
  requested: () => requested,
  complaints: () => complaints,
};

const serve = async () => {
  browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: FLAGS });
  for await (const line of createInterface({ input: process.stdin })) {
    const { do: name, ...arguments_ } = JSON.parse(line);
    const answer = await Promise.resolve(requests[name](arguments_)).then(
      (came) => ({ came: came ?? null }),
      (error) => ({ failed: error.message }),
    );
    console.log(JSON.stringify(answer));
  }
  await browser.close();
};

serve();
