/**
 * Does a server that is out of order while one comes keep one out for good? Opens page and element while it answers with 503, and looks whether
 * both say so, offer to try again, and open by themselves once it is well. Environment: see `browser.mjs`.
 */
import { gone, settle, tell, timeout, until, url } from "./browser.mjs";

const DOCUMENTS = /\/v1\/scenes/;

/** A page whose server is out of order until it is mended. */
async function behindOutage(open) {
  const page = await open(undefined, /status of 503/);
  let isWell = false;
  await page.route(DOCUMENTS, (route) => (isWell ? route.continue() : route.fulfill({ status: 503, body: "" })));
  return {
    page,
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
  const asked = whole.page.waitForRequest(DOCUMENTS, { timeout });
  await whole.page.locator("#problem-retry").click();
  await asked;
  await whole.page.locator("#problem-text").getByText("503").waitFor({ timeout });
  whole.mend();
  await settle(whole.page, "the page after an outage");
  await gone(whole.page.locator("#problem"), "the page still shows the problem though it is over");

  for (const how of ["by itself", "by its button"]) {
    const { page, mend } = await behindOutage(open);
    await page.goto(new URL("embed/example.html", url).href);
    await page.evaluate(
      (src) => {
        const element = document.querySelector("belvedere-scene");
        element.addEventListener("ready", () => {
          window.isReady = true;
        });
        element.setAttribute("src", src);
      },
      `../${search}${search ? "&" : "?"}how=${how.length}`,
    );
    await page.locator("belvedere-scene p").getByText("503").waitFor({ timeout });
    const again = page.locator("belvedere-scene button").getByText("Try again");
    await again.waitFor({ timeout });
    mend();
    // Not by the mouse, for which it may have gone: the element tries by itself, too.
    if (how === "by its button") await again.dispatchEvent("click");
    await until(page, `the element does not open ${how} after an outage`, () => window.isReady);
    await gone(page.locator("belvedere-scene p").getByText("503"), "a problem stays though it is over");
  }
  console.log("an outage keeps nobody out for good");
});
