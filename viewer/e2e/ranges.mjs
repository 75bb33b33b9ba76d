/**
 * Is a world sharp where its tree has lost the rungs of its smooth LODs? From a server that answers ranges they come as ranges of their
 * streams, from one that ignores them out of one stream that comes whole; the inspector says so, and the next visit has them.
 * Environment: see `browser.mjs`, and `BELVEDERE_TREE`, the folder of a published tree with smooth LODs of which the rungs were removed.
 */
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { join, normalize } from "node:path";
import { insist, picture, settle, state, tell, timeout, until, url } from "./browser.mjs";

const TREE = process.env.BELVEDERE_TREE;
const KINDS = { html: "text/html", js: "text/javascript", css: "text/css", json: "application/json" };
const isStream = ({ path }) => /\/[0-9a-f]{64}\.slod$/.test(path);
const isRung = ({ path }) => /\.r\d+\.slod$/.test(path);

/** Serves the tree, with ranges or without, and remembers how it answered. */
async function serve(keepsRanges) {
  const answered = [];
  const server = createServer(async (request, answer) => {
    const path = normalize(decodeURIComponent(new URL(request.url, "http://tree").pathname));
    const file = path.endsWith("/") ? `${path}index.html` : path;
    const bytes = await readFile(join(TREE, file)).catch(() => undefined);
    const [, from, last] = /^bytes=(\d+)-(\d+)$/.exec((keepsRanges && request.headers.range) || "") ?? [];
    const status = bytes ? (from ? 206 : 200) : 404;
    const body = from ? bytes?.subarray(Number(from), Number(last) + 1) : bytes;
    answered.push({ path, range: request.headers.range, status, bytes: body?.length ?? 0 });
    const place = status === 206 && { "Content-Range": `bytes ${from}-${last}/${bytes.length}` };
    answer.writeHead(status, { "Content-Type": KINDS[file.split(".").at(-1)] ?? "application/octet-stream", ...place });
    answer.end(body);
  });
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  const address = new URL(url);
  address.port = server.address().port;
  return { server, answered, address: address.href };
}

/** Waits until nothing is on its way; answers the state then. */
async function sharp(page, what) {
  await settle(page, what);
  await until(page, `${what}: something stays on its way`, () => window.belvedere.state().pending === 0);
  const now = await state(page);
  insist(now.problems.length === 0, `${what}: ${now.problems.join("; ")}`);
  return now;
}

/** What the inspector says of how requests were answered otherwise than they were asked. */
async function detours(page, shot) {
  await page.locator("#view").focus();
  await page.keyboard.press("KeyI");
  await page.getByRole("complementary", { name: "Inspector" }).waitFor();
  const rows = page.getByTestId("requests").getByText("as the rung is not there");
  await rows.first().waitFor({ timeout });
  await rows.first().scrollIntoViewIfNeeded();
  await page.screenshot({ path: picture(shot) });
  return rows.allTextContents();
}

const rungsHeld = ({ levelsHeld }) =>
  Object.entries(levelsHeld).reduce((sum, [grade, count]) => sum + (grade.startsWith("r") ? count : 0), 0);

async function withRanges(open) {
  const { server, answered, address } = await serve(true);
  // A browser says itself what is not there.
  const page = await open(undefined, /404/);
  await page.goto(address);
  const now = await sharp(page, "the place without rungs");
  insist(rungsHeld(now) > 0, "no smooth LOD is drawn");
  insist(now.notes.length === 0, `something is drawn otherwise than it could be: ${now.notes.join("; ")}`);
  const parts = answered.filter(({ status }) => status === 206);
  const first = answered.findIndex(({ status }) => status === 206);
  insist(parts.length > 1 && parts.every(isStream), `${parts.length} ranges of streams were answered`);
  const asked = answered.map(({ path, range }) => `${path} ${range}`);
  const twice = asked.filter((one, i) => one.includes(".slod") && asked.indexOf(one) !== i);
  insist(twice.length === 0, `fetched twice: ${twice.join(", ")}`);
  const late = answered.slice(first + 1).filter(isRung);
  insist(late.length < parts.length, `${late.length} rungs are asked for although there are none`);
  const told = await detours(page, "ranges");
  insist(
    told.every((why) => why.includes("by range")),
    `the inspector says: ${told.join("; ")}`,
  );
  await until(page, "what is kept is never written down", () => window.belvedere.state().keeping === 0);
  const before = answered.length;
  await page.reload();
  const again = await sharp(page, "the second visit");
  insist(rungsHeld(again) > 0, "no smooth LOD is drawn at the second visit");
  const fetched = answered.slice(before).filter((one) => isStream(one) || isRung(one));
  insist(fetched.length === 0, `the second visit fetches ${JSON.stringify(fetched)}`);
  server.close();
  return `${rungsHeld(now)} models by rungs, of which ${parts.length} came as ranges`;
}

async function withoutRanges(open) {
  const { server, answered, address } = await serve(false);
  const page = await open(undefined, /404/);
  await page.goto(address);
  const now = await sharp(page, "the place without rungs and ranges");
  const wholes = answered.filter(({ range, status }) => range && status === 200);
  insist(wholes.length === 1, `${wholes.length} streams came whole in place of a range`);
  const told = await detours(page, "ranges-ignored");
  insist(told.length === 1 && told[0].includes("all of its stream"), `the inspector says: ${told.join("; ")}`);
  insist(rungsHeld(now) > 0, "no smooth LOD is drawn");
  server.close();
  return `${wholes[0].bytes} bytes of one stream are of use to a server without ranges; ${now.visible} objects are drawn`;
}

await tell("ranges", async (open) => {
  insist(TREE, "set BELVEDERE_TREE to the folder of a tree without rungs");
  for (const story of [withRanges, withoutRanges]) console.log(await story(open));
});
