/** Can another program use the core? Builds it as the package has it, and runs the example on a small published scene. */
import { execFile } from "node:child_process";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { join } from "node:path";
import { promisify } from "node:util";
import { build } from "vite";
import { expect, it } from "vitest";
import { publish } from "./fixture.ts";

const VIEWER = join(import.meta.dirname, "..");

it("the example runs in Node, with the core by its name in the package", async () => {
  await build({ root: VIEWER, configFile: join(VIEWER, "vite.core.config.ts"), logLevel: "error" });
  const files = publish({ rooms: 6, packed: true });
  const server = createServer(({ url = "" }, answer) => {
    const bytes = files.get(url);
    answer.writeHead(bytes ? 200 : 404).end(bytes);
  });
  await new Promise<void>((listening) => server.listen(0, "127.0.0.1", listening));
  try {
    const { port } = server.address() as AddressInfo;
    const look = ["examples/look.mjs", `http://127.0.0.1:${port}/`, "rooms"];
    const { stdout, stderr } = await promisify(execFile)(process.execPath, look, { cwd: VIEWER });
    expect(stderr).toBe("");
    expect(stdout).toMatch(/, cell 0: [1-9]\d* objects can be seen\n/);
    expect(stdout).toMatch(/[1-9]\d* models are here, (\d+) of \1 bytes of the first picture\n/);
  } finally {
    server.close();
  }
  const grown = async (...args: string[]) => {
    const rules = join(VIEWER, "../content/tree.dcg");
    return promisify(execFile)(process.execPath, ["examples/grow.mjs", rules, ...args], { cwd: VIEWER });
  };
  const { stdout } = await grown("seed=3", "height=12");
  expect(stdout).toMatch(/^[1-9]\d* triangles of \d+ parts, up to 1\d\.\d\d m high\n$/);
  await expect(grown("hieght=12")).rejects.toMatchObject({ stderr: expect.stringContaining("did you mean `height`?") });
});
