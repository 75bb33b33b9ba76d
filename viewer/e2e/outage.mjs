/**
 * Does a server that is out of order while one comes keep one out for good? Opens page and element while it answers with 503, and looks whether
 * both say so, offer to try again, and open by themselves once it is well. Environment: see `browser.mjs`.
 */
import { insist, settle, tell, timeout, url } from "./browser.mjs";

const DOCUMENTS = /\/v1\/scenes/;

/** A page whose server is out of order until it is mended. */
async function behindOutage(open) {
  const page = await open(undefined, /status of 503/);
  let isWell = false;
  let asked = 0;
  await page.route(DOCUMENTS, (route) => {
    asked += 1;
    return isWell ? route.continue() : route.fulfill({ status: 503, body: "" });
  });
  return {
    page,
    asked: () => asked,
    mend: () => {
      isWell = true;
    },
  };
}

await tell("outage", async (open) => {
  const { search } = new URL(url);
  const whole = await behindOutage(open);
  await whole.page.goto(url);
  await whole.page.locator("#problem-text").getByText("503").waitFor({ timeout });
  const before = whole.asked();
  await whole.page.locator("#problem-retry").click();
  await whole.page.locator("#problem-text").getByText("503").waitFor({ timeout });
  insist(whole.asked() > before, "the page does not try again though somebody asks for it");
  whole.mend();
  await settle(whole.page, "the page after an outage");
  insist(!(await whole.page.locator("#problem").isVisible()), "the page still shows the problem though it is over");

  for (const how of ["by itself", "by its button"]) {
    const { page, mend } = await behindOutage(open);
    await page.goto(new URL("embed/example.html", url).href);
    await page.evaluate(
      (src) => {
        window.element = document.querySelector("belvedere-scene");
        window.ready = new Promise((done) => window.element.addEventListener("ready", done, { once: true }));
        window.element.setAttribute("src", src);
      },
      `../${search}${search ? "&" : "?"}how=${how.length}`,
    );
    await page.locator("belvedere-scene p").getByText("503").waitFor({ timeout });
    mend();
    if (how === "by its button") await page.locator("belvedere-scene button").getByText("Try again").click();
    const opened = page.evaluate(() => window.ready.then(() => true));
    const late = page.waitForTimeout(timeout).then(() => false);
    insist(await Promise.race([opened, late]), `the element does not open ${how} after an outage`);
    insist(
      !(await page.locator("belvedere-scene p").textContent()).includes("503"),
      "a problem stays though it is over",
    );
  }
  console.log("an outage keeps nobody out for good");
});
