/**
 * What does one learn who asks for a world of another server that this page may not read? That it may not, and what would
 * allow it; and not that the server is silent. Environment: see `browser.mjs`.
 */
import { addressOf, insist, picture, tell, timeout, url } from "./browser.mjs";

await tell("elsewhere", async (open) => {
  const page = await open(undefined, /Content Security Policy|Failed to fetch/);
  // The same server under another name is another origin.
  const other = new URL(url);
  other.hostname = other.hostname === "localhost" ? "127.0.0.1" : "localhost";
  const address = new URL(addressOf("museum"));
  address.searchParams.set("base", `${other.origin}/`);
  await page.goto(address.href);
  const problem = page.getByRole("alertdialog", { name: "This page may not show worlds of another server" });
  await problem.waitFor({ timeout });
  const text = await problem.textContent();
  insist(text.includes(`--base-origins ${other.origin}`), `the page says "${text}"`);
  await page.screenshot({ path: picture("elsewhere") });
  console.log("a page that may not read from another server says so, and what would allow it");
});
