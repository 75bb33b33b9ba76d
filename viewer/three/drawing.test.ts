import {
  BoxGeometry,
  BufferGeometry,
  DoubleSide,
  Float32BufferAttribute,
  Line,
  LineBasicMaterial,
  LineLoop,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
  Points,
  PointsMaterial,
  Texture,
} from "three";
import { beforeEach, describe, expect, it, vi } from "vitest";
import { GraphicsCard } from "../test/graphics.ts";
import { Avatars } from "./avatars.ts";
import { type Drawn, ModelBatch } from "./modelbatch.ts";
import { boxes, circle, hull, Overlay, outlined, pyramid } from "./overlay.ts";
import { Painter } from "./painter.ts";
import { Stage } from "./stage.ts";

/** A busy machine fails nothing; what hangs does. */
const PATIENCE = { timeout: 60_000 };

let card: GraphicsCard;
let stage: Stage;
let isShaded = false;
let now_ms = 0;
/** What casts shadows. */
const casting: ModelBatch[] = [];

async function begin(shadows: "on" | "off"): Promise<void> {
  card = new GraphicsCard();
  casting.length = 0;
  isShaded = shadows === "on";
  vi.stubGlobal("devicePixelRatio", 1);
  vi.stubGlobal("document", { createElement: () => new GraphicsCard("SwiftShader").canvas });
  stage = await Stage.open(card.canvas, shadows);
  // What is only seldom needed is prepared beside all else.
  await vi.waitUntil(() => card.programs >= (shadows === "on" ? 10 : 6), PATIENCE);
}

/** How many programs the card is given for a picture, and for the shadows in it; there are none while it is lost, or a roof is cut off. */
function givenForPicture({ isLost = false } = {}): number {
  const before = card.programs;
  stage.recast();
  if (isShaded) {
    const casts = !isLost && stage.cutHeight_m === undefined;
    let isCast = false;
    for (let frames = casts ? 1000 : 1; frames > 0 && !isCast; frames -= 1) {
      now_ms += 400;
      isCast = stage.cast(now_ms, casting);
    }
    expect(isCast).toBe(casts);
  }
  for (const batch of casting) batch.look(stage.view);
  stage.render(undefined);
  return card.programs - before;
}

const box = () => new BoxGeometry(1, 1, 1);
const wall = (more = {}) => new Mesh(box(), new MeshStandardMaterial(more));
const points = () => new BufferGeometry().setAttribute("position", new Float32BufferAttribute([0, 0, 0, 1, 1, 1], 3));
const coloured = (size: number) =>
  box().setAttribute("color", new Float32BufferAttribute(new Float32Array(24 * size), size));
const map = () => new Texture();

/** Parts of models, of each kind that a level can have. */
const PARTS: Record<string, () => Drawn> = {
  paint: () => wall(),
  "paint on both sides": () => wall({ side: DoubleSide }),
  "paint without normals": () => {
    const mesh = wall({ flatShading: true });
    mesh.geometry.deleteAttribute("normal");
    return mesh;
  },
  "vertex colours": () => new Mesh(coloured(3), new MeshStandardMaterial({ vertexColors: true })),
  "vertex colours with alpha": () => new Mesh(coloured(4), new MeshStandardMaterial({ vertexColors: true })),
  picture: () => wall({ map: map() }),
  pictures: () => wall({ map: map(), normalMap: map(), roughnessMap: map(), emissiveMap: map(), aoMap: map() }),
  leaves: () => wall({ map: map(), alphaTest: 0.5, side: DoubleSide }),
  pane: () => wall({ transparent: true, opacity: 0.4 }),
  "pane on both sides": () => wall({ transparent: true, side: DoubleSide }),
  unlit: () => new Mesh(box(), new MeshBasicMaterial({ map: map() })),
  lacquer: () => new Mesh(box(), new MeshPhysicalMaterial({ clearcoat: 1, sheen: 1, iridescence: 1 })),
  glass: () => new Mesh(box(), new MeshPhysicalMaterial({ transmission: 0.9, thickness: 1 })),
  "glass on both sides": () => new Mesh(box(), new MeshPhysicalMaterial({ transmission: 1, side: DoubleSide })),
  "two materials": () => new Mesh(box(), [new MeshStandardMaterial({ map: map() }), new MeshBasicMaterial()]),
  points: () => new Points(points(), new PointsMaterial()),
  "coloured points": () => new Points(coloured(3), new PointsMaterial({ vertexColors: true })),
  line: () => new Line(points(), new LineBasicMaterial()),
  lines: () => new LineSegments(points(), new LineBasicMaterial()),
  loop: () => new LineLoop(points(), new LineBasicMaterial()),
};

const PLACES: Record<string, Matrix4> = {
  upright: new Matrix4().makeTranslation(0, 0, -5),
  mirrored: new Matrix4().makeScale(-1, 1, 1).setPosition(0, 0, -5),
  sheared: new Matrix4().makeShear(0.5, 0, 0, 0, 0, 0).setPosition(0, 0, -5),
};

/** Prepares a model as the host does, and has objects of it stand everywhere. */
async function bring(...parts: Drawn[]): Promise<ModelBatch> {
  const { painted, others } = new Painter().paint(parts);
  const batch = new ModelBatch([...painted, ...others]);
  await stage.prepare(batch.sample());
  for (const [object, place] of Object.values(PLACES).entries()) batch.stand(object, place);
  stage.add(batch.root);
  casting.push(batch);
  return batch;
}

describe.each(["off", "on"] as const)("no program is made while a picture is drawn, with shadows %s,", (shadows) => {
  beforeEach(() => begin(shadows));

  it.each(Object.entries(PARTS))("of a model: %s, and what comes after it", async (_name, part) => {
    expect(givenForPicture()).toBe(0);
    await bring(part());
    expect([givenForPicture(), givenForPicture()]).toEqual([0, 0]);
    await bring(wall({ roughnessMap: map() }));
    expect(givenForPicture()).toBe(0);
  });

  it("of all of them together, also where it is cut off above, and after that", async () => {
    await bring(...Object.values(PARTS).map((part) => part()));
    expect(givenForPicture()).toBe(0);
    await stage.cutAbove(1);
    expect([stage.cutHeight_m, givenForPicture()]).toEqual([1, 0]);
    // What comes meanwhile is not cut off later.
    await bring(wall({ metalnessMap: map() }));
    expect(givenForPicture()).toBe(0);
    await stage.cutAbove(undefined);
    expect(givenForPicture()).toBe(0);
  });

  it("also not where it was prepared before one cuts, and comes into the picture after that", async () => {
    const mesh = wall({ map: map() });
    await stage.prepare(mesh);
    await stage.cutAbove(1);
    stage.add(mesh);
    expect(givenForPicture()).toBe(0);
  });

  it("of layers of the inspector, which come into the picture when they can be drawn", async () => {
    const changed = vi.fn();
    const overlay = new Overlay((root) => stage.prepare(root), changed);
    stage.add(overlay.root);
    const bounds = { min: [0, 0, -5], max: [1, 1, -4] } as const;
    const corners = [[0, 0, -5] as const, [1, 0, -5] as const, [1, 1, -5] as const];
    const ink = { color: 0xffffff, line: 0.5, fill: 0.5 };
    for (const through of [false, true]) {
      const drawn = { ...ink, through };
      overlay.set(`boxes ${through}`, boxes([bounds], drawn));
      overlay.set(`hull ${through}`, hull(corners, [[0, 1, 2]], drawn));
      overlay.set(`polygon ${through}`, outlined(corners, drawn));
      overlay.set(`pyramid ${through}`, pyramid([0, 0, 0], corners, drawn));
      overlay.set(`circle ${through}`, circle([0, 0, 0], 1, drawn));
    }
    expect([overlay.root.children.length, givenForPicture()]).toEqual([0, 0]);
    await vi.waitUntil(() => changed.mock.calls.length === 10, PATIENCE);
    expect([overlay.root.children.length, givenForPicture()]).toEqual([10, 0]);
  });

  it.each([false, true])("of people near and far, and of discs under their feet (also cut off: %s)", async (isCut) => {
    const paint = vi.fn((painting) => {
      const before = card.programs;
      stage.paint(painting);
      expect(card.programs).toBe(before);
    });
    const avatars = new Avatars({
      prepare: (root) => stage.prepare(root),
      paint,
      fetch: async () => new ArrayBuffer(),
    });
    stage.add(avatars.root);
    const people = [-1, -900].map((z, object) => ({
      object,
      position: [0, 1.6, z] as const,
      orientation: [0, 0, 0, 1] as const,
      period_ms: 100,
      worn: undefined,
    }));
    const show = (rates: boolean) =>
      avatars.show(people as never, { eye: stage.eye([0, 1.6, 0]), now_ms: performance.now(), rates });
    show(false);
    await vi.waitUntil(() => show(true), PATIENCE);
    if (isCut) await stage.cutAbove(1);
    expect([givenForPicture(), paint.mock.calls.length, avatars.root.children.length]).toEqual([0, 1, 4]);
  });

  it("of the first picture by a graphics card that was lost, all that stood there in it", async () => {
    await bring(...Object.values(PARTS).map((part) => part()));
    stage.render(undefined);
    const before = card.programs;
    const drawn = vi.fn();
    stage.onRestored(drawn);
    for (const event of ["webglcontextlost", "webglcontextrestored"] as const) card.tell(event);
    expect(givenForPicture({ isLost: true })).toBe(0);
    await vi.waitUntil(() => drawn.mock.calls.length > 0, PATIENCE);
    expect(card.programs).toBeGreaterThan(before);
    expect(givenForPicture()).toBe(0);
  });

  it("that others show again by a graphics card that was lost, once it was not lost again meanwhile", async () => {
    const material = new MeshStandardMaterial({ wireframe: true });
    const wall = new Mesh(box(), material);
    // What it took is freed, as by whoever draws seldom.
    const draw = vi.fn(() => material.dispose());
    const sample = vi.fn(() => wall);
    await stage.prepare(wall);
    stage.paint({ sample, draw });
    const drawn = vi.fn();
    stage.onRestored(drawn);
    for (const event of ["webglcontextlost", "webglcontextrestored"] as const) card.tell(event);
    for (const event of ["webglcontextlost", "webglcontextrestored"] as const) card.tell(event);
    await vi.waitUntil(() => drawn.mock.calls.length > 0, PATIENCE);
    await new Promise((later) => setTimeout(later, 100));
    expect([drawn, draw, sample].map(({ mock }) => mock.calls.length)).toEqual([1, 2, 2]);
  });
});

it("what is straight ahead is in the middle of what is not covered, also after the picture has become larger", async () => {
  await begin("off");
  stage.aim([0, 0, 0], 0, 0);
  const ahead = (x: number, y: number) => {
    stage.camera.updateMatrixWorld();
    return stage.ray(x, y).ray.direction.toArray();
  };
  const isAhead = (x: number, y: number) => {
    for (const [i, at] of [0, 0, -1].entries()) expect(ahead(x, y)[i]).toBeCloseTo(at, 9);
  };
  const { width, height } = stage.size;
  isAhead(width / 2, height / 2);
  stage.lookBeside(() => ({ right_px: stage.size.width / 2, bottom_px: 0 }));
  isAhead(width / 4, height / 2);
  Object.assign(card.canvas, { clientWidth: 2 * width });
  stage.resize("still");
  isAhead(width / 2, height / 2);
  stage.lookBeside(() => ({ right_px: 0, bottom_px: height / 2 }));
  isAhead(width, height / 4);
  stage.lookBeside();
  isAhead(width, height / 2);
});
