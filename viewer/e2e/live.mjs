/**
 * How does a test meet others, and doors that others use? What it asks a server itself, and how it knows that a page has heard of that.
 */
import { settle, timeout, until } from "./browser.mjs";

/** More than there is in any of the scenes. */
const EVERYWHERE = "-90,-9,-90,90,90,90";

/** The object of that name; none where nobody answers such questions, as in a static tree. */
export async function objectCalled(page, address, name) {
  const scene = new URL(address).searchParams.get("scene");
  const answer = await page.request.get(new URL(`/v1/scenes/${scene}/objects?bbox=${EVERYWHERE}`, address).href);
  if (!answer.ok()) return undefined;
  return (await answer.json()).objects.find(({ source_node }) => source_node === name).object;
}

/**
 * Opens the scene `doored`. Where there are live sessions one is in one then, and the page knows how the door stands: doors outlive pages
 * and servers, and before that a page moves them for itself alone. Answers whether it is closed.
 */
export async function enterDoored(page, address) {
  const door = await objectCalled(page, address, "door:leaf");
  const joined = door && page.waitForResponse((answer) => /\/events\?/.test(answer.url()), { timeout });
  await page.goto(address);
  await settle(page, "the rooms");
  if (!door) return false;
  await joined;
  const answer = await page.request.get(new URL(`/v1/scenes/doored/doors/${door}`, address).href);
  const isClosed = !(await answer.json()).open;
  await until(
    page,
    `a door that is ${isClosed ? "closed" : "open"} stands otherwise`,
    (count) => window.belvedere.state().closedDoors.length === count,
    Number(isClosed),
  );
  return isClosed;
}

/** Takes away those that were made. */
export async function removeMovers(page, made) {
  for (const { object, token } of made) {
    const address = new URL(`/v1/movers/${object}`, page.url()).href;
    await page.request.delete(address, { headers: { Authorization: `Bearer ${token}` } });
  }
}
