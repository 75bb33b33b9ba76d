/**
 * Is a world sharp where its tree has lost the rungs of its smooth LODs? From a server that answers ranges they come as ranges of their
 * streams, from one that ignores them out of one stream that comes whole; the inspector says so, and the next visit has them.
 * Environment: see `browser.mjs`, and `BELVEDERE_TREE`, the folder of a published tree of the dunes, from which the rungs were removed;
 * without that, the story is left out.
 */
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { join, normalize } from "node:path";
import { addressOf, frames, insist, picture, sharp, tell, timeout, until } from "./browser.mjs";

const TREE = process.env.BELVEDERE_TREE;
const KINDS = { html: "text/html", js: "text/javascript", css: "text/css", json: "application/json" };
/** First a picture in which coarse meshes will do, then one that takes finer ones. */
const [SMALL, LARGE] = [
  { width: 480, height: 320 },
  { width: 1280, height: 900 },
];
const isStream = ({ path }) => /\/[0-9a-f]{64}\.slod$/.test(path);
const isRung = ({ path }) => /\.r\d+\.slod$/.test(path);

const servers = [];

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
  servers.push(server);
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  return { answered, address: addressOf("dunes", `http://127.0.0.1:${server.address().port}/`) };
}

/** Looks at the place in a small picture and then in a large one, on a line on which requests cost little beside what they bring. */
async function look(open, address) {
  // A browser says itself what is not there.
  const page = await open({ viewport: SMALL }, /404/);
  await page.addInitScript(() => sessionStorage.setItem("belvedere.line", "56k"));
  await page.goto(address);
  await sharp(page, "the small picture");
  await page.setViewportSize(LARGE);
  await frames(page);
  return { page, now: await sharp(page, "the large picture") };
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
  const { answered, address } = await serve(true);
  const { page, now } = await look(open, address);
  insist(rungsHeld(now) > 0, "no smooth LOD is drawn");
  insist(now.notes.length === 0, `something is drawn otherwise than it could be: ${now.notes.join("; ")}`);
  const parts = answered.filter(({ status }) => status === 206);
  insist(parts.length > 1 && parts.every(isStream), `${parts.length} ranges of streams were answered`);
  const late = answered.slice(answered.indexOf(parts[1])).filter(isRung);
  insist(late.length === 0, `${late.length} rungs are asked for though it is known that there are none`);
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
  // What costs nothing any more may be chosen, and refined, where something else was before.
  insist(fetched.length < parts.length / 4, `the second visit fetches ${JSON.stringify(fetched)}`);
  return `${rungsHeld(now)} models by rungs, of which ${parts.length} came as ranges`;
}

async function withoutRanges(open) {
  const { answered, address } = await serve(false);
  const { page, now } = await look(open, address);
  const wholes = answered.filter(({ range, status }) => range && status === 200);
  insist(wholes.length === 1, `${wholes.length} streams came whole in place of a range`);
  const told = await detours(page, "ranges-ignored");
  insist(told.length === 1 && told[0].includes("all of its stream"), `the inspector says: ${told.join("; ")}`);
  insist(rungsHeld(now) > 0, "no smooth LOD is drawn");
  insist(now.notes.length === 0, `something is drawn otherwise than it could be: ${now.notes.join("; ")}`);
  const summary = await page.getByText(/^Of the last \d+:/).textContent();
  insist(!summary.includes("failed"), `the inspector says: ${summary}`);
  return `${wholes[0].bytes} bytes of one stream are of use to a server without ranges; ${now.visible} objects are drawn`;
}

if (TREE) {
  await tell("ranges", async (open) => {
    for (const story of [withRanges, withoutRanges]) console.log(await story(open));
  });
} else {
  console.log("ranges: left out, as BELVEDERE_TREE names no folder of a tree without rungs");
}
for (const server of servers) server.close();
