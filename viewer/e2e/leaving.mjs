/**
 * Is a world let go with its element? Shows one several times, takes it away while it comes and when it stands there, and looks whether the
 * browser can free element, canvas and what was drawn with; of an element that the page keeps, all but itself. Environment: see `browser.mjs`.
 */
import { frames, insist, tell, timeout, url } from "./browser.mjs";

const { search } = new URL(url ?? "http://localhost");

/** In the page: shows a world until it is ready, or until it says that it comes, and takes it away. */
async function showOnce([src, isEarly, isKept]) {
  const element = document.createElement("belvedere-scene");
  element.src = src;
  const ready = new Promise((resolve) => element.addEventListener("ready", resolve, { once: true }));
  document.body.append(element);
  const comes = new Promise((resolve) =>
    new MutationObserver(resolve).observe(element.shadowRoot.querySelector("p"), { childList: true }),
  );
  await (isEarly ? Promise.race([comes, ready]) : ready);
  const canvas = element.shadowRoot.querySelector("canvas");
  window.left.push(new WeakRef(canvas));
  if (isKept) window.kept = element;
  else window.left.push(new WeakRef(element));
  element.remove();
}

await tell("leaving", async (open) => {
  const page = await open();
  await page.goto(new URL("embed/example.html", url).href, { waitUntil: "commit" });
  await page.waitForFunction(() => customElements.get("belvedere-scene") && document.querySelector("belvedere-scene"));
  await page.evaluate(() => {
    window.left = [];
    document.querySelector("belvedere-scene").remove();
  });
  for (const isEarly of [false, true, false]) await page.evaluate(showOnce, [`../${search}`, isEarly]);
  await page.evaluate(showOnce, [`../${search}`, false, true]);
  const browser = await page.context().newCDPSession(page);
  const collected = async () => {
    await browser.send("HeapProfiler.collectGarbage");
    return page.evaluate(() => window.left.filter((one) => one.deref()).map((one) => one.deref().localName));
  };
  let held = await collected();
  for (const until = Date.now() + timeout; held.length > 0 && Date.now() < until; ) {
    await frames(page);
    held = await collected();
  }
  insist(held.length === 0, `what has left the page is still held: ${held.join(", ")}`);
  console.log("who leaves takes all with it");
});
