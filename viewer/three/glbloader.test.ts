import { expect, it } from "vitest";
import { box, encodeGlb } from "../test/encode.ts";
import { textureUrls } from "./glbloader.ts";

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
