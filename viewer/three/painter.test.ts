import {
  BoxGeometry,
  BufferGeometry,
  DoubleSide,
  Float32BufferAttribute,
  FrontSide,
  Line,
  type Material,
  Mesh,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
  ShaderLib,
  SkinnedMesh,
  Texture,
} from "three";
import { describe, expect, it } from "vitest";
import { Painter } from "./painter.ts";
import { paintMaterial } from "./paintmaterial.ts";
import { Palette } from "./palette.ts";

const box = () => new BoxGeometry(1, 1, 1);
const paint = (color: number, more = {}) => new MeshStandardMaterial({ color, ...more });
const part = (material: Material, x = 0) => {
  const mesh = new Mesh(box(), material);
  mesh.matrixWorld.makeTranslation(x, 0, 0);
  return mesh;
};
const paintsOf = ({ geometry }: Mesh) => {
  const attribute = geometry.getAttribute("paint");
  return new Set(Array.from({ length: attribute.count }, (_, i) => attribute.getX(i))).size;
};

describe("a model's plain meshes", () => {
  it("become one for each place and for one or two sides, and all models share their materials", () => {
    const painter = new Painter();
    const house = painter.paint([
      part(paint(0xff0000)),
      part(paint(0x00ff00, { roughness: 0.2 })),
      part(paint(0xff0000, { side: DoubleSide })),
      part(paint(0x0000ff), 5),
      part(paint(0x0000ff, { side: DoubleSide })),
    ]);
    expect(house.painted.map(paintsOf)).toEqual([2, 2, 1]);
    expect(house.painted.map(({ matrixWorld }) => matrixWorld.elements[12])).toEqual([0, 0, 5]);
    const corners = box().index?.count as number;
    expect(house.painted.map(({ geometry }) => geometry.index?.count)).toEqual([2 * corners, 2 * corners, corners]);
    expect(house.painted.map(({ material }) => (material as Material).side)).toEqual([
      FrontSide,
      DoubleSide,
      FrontSide,
    ]);
    const lamp = painter.paint([part(paint(0x123456))]);
    expect([lamp.painted[0]?.material, house.painted[2]?.material]).toEqual([
      house.painted[0]?.material,
      house.painted[0]?.material,
    ]);
  });

  it("do not stumble over one that has no places", () => {
    const empty = new Mesh(new BufferGeometry(), paint(0xff0000));
    const { painted, others, paints } = new Painter().paint([part(paint(0xff0000)), empty]);
    expect([painted.length, others, paints]).toEqual([1, [empty], [0]]);
  });

  it("keep the colours that their vertices have besides, apart from those that have none", () => {
    const painter = new Painter();
    const bright = part(paint(0xffffff, { vertexColors: true }));
    const { count } = bright.geometry.getAttribute("position");
    bright.geometry.setAttribute("color", new Float32BufferAttribute(new Float32Array(3 * count).fill(0.5), 3));
    const { painted } = painter.paint([bright, part(paint(0xffffff))]);
    const finishes = painted.map(({ material, geometry }) => [
      (material as MeshStandardMaterial).vertexColors,
      geometry.hasAttribute("color"),
    ]);
    expect(finishes).toEqual([
      [true, true],
      [false, false],
    ]);
  });

  it("leave alone what is seen through, has pictures, holes or a gloss of its own, moves, or is no surface", () => {
    const moving = new SkinnedMesh(box(), paint(1));
    const morphed = part(paint(1));
    morphed.geometry.morphAttributes.position = [new Float32BufferAttribute(new Float32Array(72), 3)];
    const others = [
      part(paint(1, { transparent: true })),
      part(paint(1, { emissiveMap: new Texture() })),
      part(paint(1, { alphaTest: 0.5 })),
      part(new MeshPhysicalMaterial({ clearcoat: 1 })),
      new Mesh(box(), [paint(1), paint(2)]),
      moving,
      morphed,
      new Line(new BufferGeometry()),
    ];
    const result = new Painter().paint([...others, part(paint(1))]);
    expect(result.others).toEqual(others);
    expect([result.painted.length, result.paints.length]).toEqual([1, 1]);
  });

  it("use paints until these are released, and are left alone while there is no paint any more", () => {
    const painter = new Painter();
    const used = Array.from({ length: 65_536 }, (_, i) => painter.paint([part(paint(i))]).paints);
    const lacking = painter.paint([part(paint(70_000)), part(paint(7))]);
    expect([lacking.painted.length, lacking.others.length]).toEqual([1, 1]);
    painter.release(used[3] ?? []);
    expect(painter.paint([part(paint(70_000))]).paints).toEqual(used[3]);
  });
});

it("the shader takes its paint from the palette and nowhere else", () => {
  const material = paintMaterial(new Palette().uniform, { side: FrontSide, vertexColors: false, flatShading: false });
  const { vertexShader, fragmentShader } = ShaderLib.standard;
  const shader = { uniforms: {}, vertexShader, fragmentShader };
  material.onBeforeCompile(shader as never, null as never);
  expect(shader.vertexShader.match(/texelFetch\(palette/g)?.length).toBe(2);
  for (const taken of ["diffuseColor.rgb =", "roughnessFactor =", "metalnessFactor =", "totalEmissiveRadiance ="]) {
    const line = shader.fragmentShader.split("\n").filter((one) => one.includes(`${taken} v`));
    expect(line.length, taken).toBe(1);
  }
  for (const chunk of ["roughnessmap_fragment", "metalnessmap_fragment", "emissivemap_fragment"]) {
    expect(shader.fragmentShader).not.toContain(`<${chunk}>`);
  }
});
