/**
 * Which pages can show a world with one tag? One that says what to show before the element is known, one of another origin
 * with no more than the Content Security Policy that the README asks for; and one whose policy lacks something is told what.
 * Environment: see `browser.mjs`.
 */
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { frames, insist, picture, tell, timeout, until, url } from "./browser.mjs";

const tree = new URL(url);
const readme = readFileSync(new URL("../README.md", import.meta.url), "utf8");
/** What the README asks for, with the host of this test. */
const POLICY = readme.match(/```\nContent-Security-Policy: (.*)\n```/)?.[1].replaceAll("https://host", tree.origin);
const LINK = new URL(`./${tree.search}`, tree).href;

/** What the server of another origin sends. */
const hosted = { headers: {}, body: "" };
const server = createServer((_, answer) => {
  answer.writeHead(200, { "Content-Type": "text/html", ...hosted.headers }).end(hosted.body);
});
await new Promise((listening) => server.listen(0, "127.0.0.1", listening));

/** A page of another origin with a tag, and a script that runs before the element is known. */
async function visit(open, { policy, attributes = "", early = "", forgive }) {
  const page = await open(undefined, forgive);
  const script = new URL("embed/belvedere-scene.js", tree).href;
  hosted.headers = policy ? { "Content-Security-Policy": policy } : {};
  hosted.body = `<!doctype html><title>host</title><link rel="icon" href="data:,"><body>
    <belvedere-scene ${attributes}></belvedere-scene>
    <script nonce="host">
      window.scene = document.querySelector("belvedere-scene");
      scene.addEventListener("ready", () => { window.result ??= "ready"; });
      scene.addEventListener("problem", ({ detail }) => { window.result ??= detail.name; });
      window.violations = [];
      addEventListener("securitypolicyviolation", ({ violatedDirective }) => violations.push(violatedDirective));
      ${early}
    </script>
    <script type="module" src="${script}"></script>`;
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await until(page, "neither ready nor a problem", () => window.result);
  const result = await page.evaluate(() => window.result);
  const says = await page.locator("belvedere-scene p").textContent();
  return { page, result, says, violations: await page.evaluate(() => window.violations) };
}

await tell("hosts", async (open) => {
  const link = JSON.stringify(LINK);
  const early = await visit(open, { early: `scene.src = ${link};` });
  insist(early.result === "ready", `a link that is set early: ${early.result}; the element says "${early.says}"`);
  insist((await early.page.evaluate(() => scene.getAttribute("src"))) === LINK, "an early link is no attribute");
  const { position, yaw, pitch } = await early.page.evaluate(() => scene.pose);
  await early.page.close();

  const place = JSON.stringify({ position, yaw: yaw + 1, pitch });
  const posed = await visit(open, { attributes: `src='${LINK}'`, early: `scene.pose = ${place};` });
  insist(posed.result === "ready", `a pose that is set early: ${posed.result}`);
  const turned = (await posed.page.evaluate(() => scene.pose.yaw)) - yaw;
  insist(Math.abs(Math.cos(turned) - Math.cos(1)) < 1e-6, `a pose that is set early is not taken: turned by ${turned}`);
  await posed.page.close();

  insist(POLICY?.includes("'wasm-unsafe-eval'"), "the README names no policy");
  // Nothing else is allowed, but for the script of the page.
  const policy = `default-src 'none'; img-src data:; ${POLICY.replace("script-src", "script-src 'nonce-host'")}`;
  const allowed = await visit(open, { attributes: `src='${LINK}'`, policy });
  insist(allowed.result === "ready", `with the policy of the README: ${allowed.result}; it says "${allowed.says}"`);
  insist(allowed.violations.length === 0, `the policy of the README forbids ${allowed.violations}`);
  await frames(allowed.page);
  await allowed.page.screenshot({ path: picture("hosts-allowed") });
  await allowed.page.close();

  const refusals = [
    { lacks: " 'wasm-unsafe-eval'", name: "NoDecoderError", told: "add 'wasm-unsafe-eval' to script-src" },
    { lacks: `connect-src ${tree.origin}`, name: "ForbiddenTree", told: tree.origin },
  ];
  for (const { lacks, name, told } of refusals) {
    insist(policy.includes(lacks), `the policy has no ${lacks}`);
    const short = policy.replace(lacks, lacks.startsWith("connect") ? "connect-src" : "");
    const forgive = /Content Security Policy|Failed to fetch/;
    const { page, result } = await visit(open, { attributes: `src='${LINK}'`, policy: short, forgive });
    insist(result === name, `without ${lacks}: ${result}`);
    const isTold = (what) => {
      const line = scene.shadowRoot.querySelector("p");
      return !line.hidden && line.textContent.includes(what);
    };
    await until(page, `without ${lacks} the element does not say so`, isTold, told);
    await frames(page);
    await page.screenshot({ path: picture(`hosts-${name}`) });
    await page.close();
  }

  // The viewer's own page, behind a web server that forbids it.
  const page = await open(undefined, /Content Security Policy/);
  await page.route(LINK, async (route) => {
    const response = await route.fetch();
    const headers = { ...response.headers(), "content-security-policy": "script-src 'self'" };
    await route.fulfill({ response, headers });
  });
  await page.goto(LINK);
  const problem = page.getByRole("alertdialog", { name: "This page may not decode 3-D models" });
  await problem.waitFor({ timeout });
  insist(
    (await problem.textContent()).includes("add 'wasm-unsafe-eval'"),
    "the viewer's page does not say what to add",
  );
  await page.screenshot({ path: picture("hosts-viewer") });
  console.log("pages with a strict policy show a world, and are told what it lacks; what is set early counts");
});
server.close();
