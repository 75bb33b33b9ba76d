/** Can another program use the core? Builds it as the package has it, and runs its examples, on a small published scene, on rules and on a smooth LOD. */
import { execFile } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { build } from "vite";
import { expect, it } from "vitest";
import { publish } from "./fixture.ts";

const VIEWER = join(import.meta.dirname, "..");

it("the examples run in Node, with the core by its name in the package", async () => {
  await build({ root: VIEWER, configFile: join(VIEWER, "vite.core.config.ts"), logLevel: "error" });
  const files = publish({ rooms: 6, packed: true });
  const server = createServer(({ url = "" }, answer) => {
    const bytes = files.get(url);
    answer.writeHead(bytes ? 200 : 404).end(bytes);
  });
  await new Promise<void>((listening) => server.listen(0, "127.0.0.1", listening));
  const base = `http://127.0.0.1:${(server.address() as AddressInfo).port}/`;
  const look = (...args: string[]) =>
    promisify(execFile)(process.execPath, ["examples/look.mjs", ...args], { cwd: VIEWER });
  try {
    const { stdout, stderr } = await look(base, "rooms");
    expect(stderr).toBe("");
    expect(stdout).toMatch(/, cell 0: [1-9]\d* objects can be seen\n/);
    expect(stdout).toMatch(/[1-9]\d* models are here, (\d+) of \1 bytes of the first picture\n/);
    await expect(look(base, "halls")).rejects.toMatchObject({
      code: 1,
      stderr: `there is no scene halls at ${base}\n`,
    });
    await expect(look(base)).rejects.toMatchObject({
      code: 1,
      stderr: expect.stringMatching(/^name a tree and a scene/),
    });
  } finally {
    server.close();
  }
  await expect(look(base, "rooms")).rejects.toMatchObject({ code: 1, stderr: `nobody answers at ${base}\n` });
  const grown = async (...args: string[]) => {
    const rules = join(VIEWER, "../content/tree.dcg");
    return promisify(execFile)(process.execPath, ["examples/grow.mjs", rules, ...args], { cwd: VIEWER });
  };
  const { stdout } = await grown("seed=3", "height=12");
  expect(stdout).toMatch(/^[1-9]\d* triangles of \d+ parts, up to 1\d\.\d\d m high\n$/);
  await expect(grown("hieght=12")).rejects.toMatchObject({ stderr: expect.stringContaining("did you mean `height`?") });
  await expect(grown("height=tall")).rejects.toMatchObject({
    stderr: "height is tall; write a number or a list of numbers\n",
  });
  // What lies outside of the folder is read neither by a path nor through a link.
  const outside = mkdtempSync(join(tmpdir(), "rules-"));
  try {
    mkdirSync(join(outside, "yard/lib"), { recursive: true });
    writeFileSync(join(outside, "gate.dcg"), "box(1, 2, 1)");
    writeFileSync(join(outside, "yard/lib/post.dcg"), "box(1, 3, 1)");
    symlinkSync("../gate.dcg", join(outside, "yard/link.dcg"));
    const growOf = (path: string) => {
      const yard = join(outside, "yard/yard.dcg");
      writeFileSync(yard, `import "${path}" as it\nit()`);
      return promisify(execFile)(process.execPath, ["examples/grow.mjs", yard], { cwd: VIEWER });
    };
    const alone = (path: string) => promisify(execFile)(process.execPath, ["examples/grow.mjs", path], { cwd: VIEWER });
    writeFileSync(join(outside, "sight.dcg"), 'viewpoint "a"');
    expect((await alone(join(outside, "sight.dcg"))).stdout).toBe("the rules draw nothing\n");
    const absent = join(outside, "absent.dcg");
    await expect(alone(absent)).rejects.toMatchObject({ stderr: `there is no file ${absent}\n` });
    expect((await growOf("lib/../lib//post.dcg")).stdout).toMatch(/up to 3\.00 m high\n$/);
    for (const [path, told] of [
      [
        "../gate.dcg",
        '"../gate.dcg" cannot be imported: it lies outside of the source\'s folder: put it beside the source',
      ],
      [join(outside, "gate.dcg"), "it begins with `/`, at the root of a disk: put the file beside the source"],
      ["absent.dcg", '"absent.dcg" cannot be imported: there is no such file beside the rules'],
      ["link.dcg", "a link leads out of the source's folder"],
    ] as const) {
      await expect(growOf(path)).rejects.toMatchObject({ stderr: expect.stringContaining(told) });
    }
  } finally {
    rmSync(outside, { recursive: true });
  }
  const bowl = ["examples/select.mjs", join(VIEWER, "../tests/golden/smooth/bowl.slod")];
  const selected = await promisify(execFile)(process.execPath, bowl, { cwd: VIEWER });
  const triangles = [...selected.stdout.matchAll(/away: (\d+) of (\d+) triangles/g)].map(([, n]) => Number(n));
  const [first = 0, , , nearest = 0, last = 0] = triangles;
  expect(triangles).toHaveLength(5);
  expect(nearest).toBeGreaterThan(first);
  expect(last).toBeLessThan(nearest);
});
