// Driver of Chromium. Each line on stdin is a request {"do": …}, answered by {"result": …} or {"error": …}.
const { readFileSync } = require("fs");
const { createInterface } = require("readline");
const { chromium } = require("playwright-core");

const AXE = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const TIMEOUT_MS = 60000; // a computer can be slow without a process that waits for a processor
const POLL_MS = 50;
const MAX_TEXT = 1000;
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
const requestedUrls = [];
const errors = [];

const recordRequestsAndErrors = (context) => {
  context.on("request", (request) => requestedUrls.push(request.url()));
  context.on("weberror", (error) => errors.push(error.error().message));
  context.on("console", (message) => message.type() === "error" && errors.push(message.text()));
};

/**
 * Evaluate a script until its value is true, and return the value.
 *
 * Playwright's waitForFunction evaluates inside the page, which the Content-Security-Policy forbids.
 */
const waitForValue = async (script) => {
  const until_ms = Date.now() + TIMEOUT_MS;
  for (;;) {
    const value = await page.evaluate(script);
    if (value) return value;
    if (Date.now() > until_ms)
      throw new Error(`timeout; text of the page: ${(await page.innerText("body")).slice(0, MAX_TEXT)}`);
    await page.waitForTimeout(POLL_MS);
  }
};

/** Return the coordinates of a point of an element, given as parts of its width and height. */
const pointOf = async (on, [across, down]) => {
  await page.locator(on).scrollIntoViewIfNeeded();
  const { x, y, width, height } = await page.locator(on).boundingBox();
  return [x + across * width, y + down * height];
};

const actions = {
  /**
   * Open a new context. `scripts: false` disables JavaScript. `touch: true` is a touch screen without a mouse.
   * Requests whose address ends in `without` fail.
   */
  open: async ({ url, scripts = true, touch = false, without = "" }) => {
    await page?.context().close();
    const context = await browser.newContext({ javaScriptEnabled: scripts, hasTouch: touch, isMobile: touch });
    context.setDefaultTimeout(TIMEOUT_MS);
    recordRequestsAndErrors(context);
    page = await context.newPage();
    if (without) await page.route(`**${without}`, (route) => route.abort());
    await page.goto(url);
  },
  reload: () => page.reload().then(() => undefined),
  resize: async ({ width, height, scheme = "light" }) => {
    await page.setViewportSize({ width, height });
    await page.emulateMedia({ colorScheme: scheme });
  },
  evaluate: ({ script }) => page.evaluate(script),
  wait: ({ script }) => waitForValue(script),
  press: ({ key }) => page.keyboard.press(key),
  click: ({ on }) => page.click(on),
  fill: ({ on, text }) => page.fill(on, text),
  /** Move the mouse to a point of an element, given as parts of its width and height. */
  point: async ({ on, at }) => page.mouse.move(...(await pointOf(on, at))),
  /** Press the mouse at one point of an element, and release it at another point. */
  drag: async ({ on, from, to }) => {
    await page.mouse.move(...(await pointOf(on, from)));
    await page.mouse.down();
    await page.mouse.move(...(await pointOf(on, to)), { steps: 4 });
    await page.mouse.up();
  },
  doubleClick: ({ on }) => page.dblclick(on),
  /** Put fingers on an element. Each step has the points of all fingers; the fingers are lifted after the last. */
  touch: async ({ on, steps }) => {
    const session = await page.context().newCDPSession(page);
    await session.send("Emulation.setTouchEmulationEnabled", { enabled: true, maxTouchPoints: 2 });
    for (const [index, fingers] of [...steps, []].entries()) {
      const points = await Promise.all(fingers.map((at) => pointOf(on, at)));
      const type = !fingers.length ? "touchEnd" : index ? "touchMove" : "touchStart";
      const touchPoints = points.map(([x, y], id) => ({ x, y, id }));
      await session.send("Input.dispatchTouchEvent", { type, touchPoints });
    }
    await session.send("Emulation.setTouchEmulationEnabled", { enabled: false });
  },
  /** Click an element that starts a download. Return the name of the file, and its content as base64. */
  download: async ({ on }) => {
    const [download] = await Promise.all([page.waitForEvent("download"), page.click(on)]);
    return { name: download.suggestedFilename(), base64: readFileSync(await download.path(), "base64") };
  },
  text: ({ of }) => page.innerText(of),
  screenshot: ({ path }) => page.screenshot({ path }).then(() => undefined),
  /** Return the violations that axe-core finds: [rule, impact, HTML of the first element]. */
  audit: async () => {
    const found = await page.evaluate(`${AXE}; axe.run().then(({ violations }) => violations)`);
    return found.map(({ id, impact, nodes }) => [id, impact, nodes[0].html]);
  },
  requestedUrls: () => requestedUrls,
  errors: () => errors,
};

const serve = async () => {
  browser = await chromium.launch({ executablePath: "/usr/bin/chromium", args: FLAGS });
  for await (const line of createInterface({ input: process.stdin })) {
    const { do: name, ...arguments_ } = JSON.parse(line);
    const run = async () => actions[name](arguments_);
    const answer = await run().then(
      (result) => ({ result: result ?? null }),
      (error) => ({ error: error.message }),
    );
    console.log(JSON.stringify(answer));
  }
  await browser.close();
};

serve();
