import { Matrix4, PerspectiveCamera, Raycaster, Vector3 } from "three";
import { describe, expect, it, vi } from "vitest";
import type { PlacedObject } from "../core/documents/placedobject.ts";
import { glbOf } from "../core/models/glb.ts";
import { box, encodeGlb } from "../test/encode.ts";
import { InstanceMesh } from "./instancemesh.ts";
import { ThreeModelHost } from "./modelhost.ts";
import { Palette } from "./palette.ts";
import { ViewVolume } from "./viewvolume.ts";

const glb = () => encodeGlb(box([0, 0, 0], [1, 1, 1]), [1, 1, 1]).buffer as ArrayBuffer;

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
  const upload = async (host: ThreeModelHost, part: "base" | "detail", level = glb()) => {
    const decoded = await host.decode(1, level, new Map());
    await decoded.ready;
    decoded.draw(part);
    return decoded.bytes;
  };
  /** Objects that a ray meets, from above. */
  const standing = (host: ThreeModelHost) =>
    Array.from({ length: 30 }, (_, x) =>
      host.pick(new Raycaster(new Vector3(x + 0.5, 9, 0.5), new Vector3(0, -1, 0))),
    ).map((object) => object?.entry.object);
  const inRow = (...objects: number[]) => at(Object.fromEntries(objects.map((object) => [object, object])));
  const at = (places: Readonly<Record<number, number>>) => Array.from({ length: 30 }, (_, x) => places[x]);
  /** What is drawn, as the graphics card is told: where along the row. */
  const drawn = (host: ThreeModelHost) => {
    const camera = new PerspectiveCamera(90, 1, 0.1, 100);
    camera.position.set(15, 0, 20);
    camera.updateMatrixWorld();
    host.look([15, 0, 20], new ViewVolume(camera));
    const meshes = host.root.children.flatMap(({ children }) => children.filter((one) => one instanceof InstanceMesh));
    const matrix = new Matrix4();
    const places = meshes
      .filter(({ visible }) => visible)
      .map((mesh) =>
        Array.from({ length: mesh.count }, (_, i) => {
          mesh.getMatrixAt(i, matrix);
          return matrix.elements[12];
        }),
      );
    return { calls: places.length, places: places.flat() };
  };

  it("is placed in turn, the most important first, where the model is here, and counts as drawn meanwhile", async () => {
    const host = new ThreeModelHost(
      () => {},
      async () => {},
    );
    await upload(host, "base");
    host.show([placed(2), placed(1), placed(3, 9)]);
    expect([host.waiting, standing(host)]).toEqual([2, inRow()]);
    expect([1, 2, 3].map((object) => host.draws(object))).toEqual([true, true, false]);
    host.place(0);
    expect(standing(host)[2]).toBe(2);
    host.place(1e6);
    expect([host.waiting, standing(host)]).toEqual([0, inRow(1, 2)]);
    expect(drawn(host)).toEqual({ calls: 1, places: [2, 1] });
  });

  it("is replaced in one step by what is finer, and goes with what is shown", async () => {
    const host = new ThreeModelHost(
      () => {},
      async () => {},
    );
    await upload(host, "base");
    const many = Array.from({ length: 20 }, (_, object) => placed(object));
    host.show(many);
    host.place(1e6);
    const numbers = many.map(({ entry }) => entry.object);
    expect(drawn(host)).toEqual({ calls: 1, places: numbers });
    const before = new Set(host.root.children);
    await upload(host, "detail");
    expect([host.waiting, standing(host)]).toEqual([0, inRow(...numbers)]);
    expect(drawn(host)).toEqual({ calls: 1, places: numbers });
    const [finer, ...others] = host.root.children.filter((batch) => !before.has(batch));
    expect([finer?.children.length, others]).toEqual([1, []]);
    host.blunt(1);
    expect([drawn(host), host.root.children.length]).toEqual([{ calls: 1, places: numbers }, 1]);
    host.show(many.slice(0, 2));
    expect(standing(host)).toEqual(inRow(0, 1));
    host.evict(1);
    expect([standing(host), host.draws(0), host.root.children]).toEqual([inRow(), false, []]);
  });

  it("gives its paints back when it goes", async () => {
    const [take, release] = [vi.spyOn(Palette.prototype, "take"), vi.spyOn(Palette.prototype, "release")];
    const host = new ThreeModelHost(
      () => {},
      async () => {},
    );
    await upload(host, "base");
    await upload(host, "detail");
    const taken = take.mock.results.map(({ value }) => value);
    expect([taken, release.mock.calls]).toEqual([[0, 0], []]);
    host.blunt(1);
    expect(release.mock.calls).toEqual([[0]]);
    host.evict(1);
    expect(release.mock.calls).toEqual([[0], [0]]);
    vi.restoreAllMocks();
  });

  it("stays while the graphics card is prepared for what is finer, which is decoded meanwhile and may be released", async () => {
    const host = new ThreeModelHost(
      () => {},
      () => new Promise(() => {}),
    );
    const finer = () => host.decode(1, glb(), new Map());
    (await finer()).draw("base");
    host.show([placed(1)]);
    host.place(1e6);
    const before = host.root.children[0];
    const [dropped, decoded] = [await finer(), await finer()];
    expect([host.root.children, drawn(host).calls]).toEqual([[before], 1]);
    dropped.release();
    expect([host.root.children, drawn(host).calls]).toEqual([[before], 1]);
    decoded.draw("detail");
    expect([host.root.children.length, drawn(host).calls]).toEqual([2, 1]);
  });

  it("is drawn by one call where its surfaces are plainly painted, and by one more where one sees through", async () => {
    const host = new ThreeModelHost(
      () => {},
      async () => {},
    );
    const { positions, indices } = box([0, 0, 0], [1, 1, 1]);
    const vertices = { positions: Float32Array.from(positions), others: [] };
    const triangles = [0, 1, 2].map((material) => ({ vertices, indices: Uint32Array.from(indices), material }));
    const colour = (...baseColorFactor: number[]) => ({ pbrMetallicRoughness: { baseColorFactor } });
    const materials = [colour(1, 0, 0, 1), colour(0, 1, 0, 1), { ...colour(0, 0, 1, 0.5), alphaMode: "BLEND" }];
    const bytes = await upload(host, "base", glbOf(triangles, { materials }));
    host.show([placed(1), placed(2)]);
    host.place(1e6);
    expect([drawn(host), standing(host)]).toEqual([{ calls: 1, places: [1, 2] }, inRow(1, 2)]);
    const alone = host.root.children.flatMap(({ children }) =>
      children.filter((one) => !(one instanceof InstanceMesh)),
    );
    expect(alone.length).toBe(2);
    // What is painted: 24 vertices for each paint, of 12 bytes for the place and 4 for the paint; the pane as it came.
    expect(bytes).toBe(2 * (24 * 16 + 36 * 2) + 24 * 12 + 36 * 2);
    let freed = 0;
    for (const { children } of host.root.children) {
      for (const one of children) (one as InstanceMesh).geometry.addEventListener("dispose", () => (freed += 1));
    }
    host.evict(1);
    expect(freed).toBe(1 + 2);
  });

  it("goes where it is moved, and where it is known to be instead of roughly", async () => {
    const host = new ThreeModelHost(
      () => {},
      async () => {},
    );
    await upload(host, "base");
    host.show([placed(1), placed(2)]);
    host.place(1e6);
    host.move(2, new Matrix4().makeTranslation(7, 0, 0));
    expect(standing(host)).toEqual(at({ 1: 1, 9: 2 }));
    const known = placed(2);
    host.show([placed(1), { ...known, entry: { ...known.entry, worldFromObject: placed(4).entry.worldFromObject } }]);
    expect([standing(host), host.waiting]).toEqual([at({ 1: 1, 11: 2 }), 0]);
  });
});
