import { describe, expect, it } from "vitest";
import type { PlacedObject } from "../core/objects.ts";
import { box, encodeGlb } from "../test/encode.ts";
import { ThreeModelHost, textureUrls } from "./modelhost.ts";

const NAME = `${"ab".repeat(32)}.png`;
const glb = (texture?: string) => encodeGlb(box([0, 0, 0], [1, 1, 1]), [1, 1, 1], texture).buffer as ArrayBuffer;

it("a GLB names the published pictures beside it, and no others", () => {
  expect(textureUrls(glb(NAME))).toEqual([`/o/${NAME}`]);
  expect(textureUrls(glb(`./${NAME}`))).toEqual([`/o/${NAME}`]);
  expect(textureUrls(glb())).toEqual([]);
  for (const uri of ["https://evil/x.png", "data:image/png;base64,AAAA", "../secret.png"]) {
    expect(textureUrls(glb(uri)), uri).toEqual([]);
  }
});

it("a GLB that is cut short is refused at every length up to the end of its JSON", () => {
  const whole = glb(NAME);
  const end = 20 + new DataView(whole).getUint32(12, true);
  for (let length = 0; length < end; length += 1) expect(() => textureUrls(whole.slice(0, length))).toThrow();
});

describe("what is shown", () => {
  const placed = (object: number, model = 1): PlacedObject => ({
    entry: {
      object,
      sourceNode: `thing ${object}`,
      bounds: { min: [object, 0, 0], max: [object + 1, 1, 1] },
      worldFromObject: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, object, 0, 0, 1],
      scale: 1,
      model,
    },
    model: { model, levels: [] },
  });
  const upload = (host: ThreeModelHost, part: "base" | "detail") => host.upload(1, part, glb(), new Map());
  const standing = ({ root }: ThreeModelHost) => root.children.map(({ name }) => name);

  it("is placed in turn, the most important first, where the model is here, and counts as drawn meanwhile", async () => {
    const host = new ThreeModelHost(() => {});
    await upload(host, "base");
    host.show([placed(2), placed(1), placed(3, 9)]);
    expect([host.waiting, standing(host)]).toEqual([2, []]);
    expect([1, 2, 3].map((object) => host.draws(object))).toEqual([true, true, false]);
    host.place(0);
    expect(standing(host)).toContain("thing 2");
    host.place(1e6);
    expect([host.waiting, standing(host)]).toEqual([0, ["thing 2", "thing 1"]]);
    const [first] = host.root.children;
    expect(first?.matrixWorld.elements[12]).toBe(2);
  });

  it("is replaced in one step by what is finer, and goes with what is shown", async () => {
    const host = new ThreeModelHost(() => {});
    await upload(host, "base");
    const many = Array.from({ length: 20 }, (_, object) => placed(object));
    host.show(many);
    host.place(1e6);
    const before = new Set(host.root.children);
    await upload(host, "detail");
    expect([host.waiting, host.root.children.length]).toEqual([0, 20]);
    expect(host.root.children.some((node) => before.has(node))).toBe(false);
    host.show(many.slice(0, 2));
    expect(standing(host)).toEqual(["thing 0", "thing 1"]);
    host.evict(1);
    expect([standing(host), host.draws(0)]).toEqual([[], false]);
  });
});
