import {
  BoxGeometry,
  type Camera,
  DirectionalLight,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  Vector3,
  type WebGLRenderer,
  type WebGLRenderTarget,
} from "three";
import { expect, it } from "vitest";
import { TILES } from "./shading.ts";
import { type Casting, ShadowMap } from "./shadowmap.ts";

const EXTENT = { centre: new Vector3(), reach_m: 192 };
/** More than are drawn at a time. */
const MANY = 40;

/** A sun, a shadow map, and what a renderer is asked to draw into which target. */
function lit() {
  let target: WebGLRenderTarget | null = null;
  const drawn = new Map<WebGLRenderTarget | null, Object3D[]>();
  const renderer = {
    autoClear: true,
    shadowMap: { enabled: false, autoUpdate: true },
    getRenderTarget: () => target,
    setRenderTarget: (next: WebGLRenderTarget | null) => {
      target = next;
    },
    clear: () => void drawn.set(target, []),
    render: (scene: Object3D, _camera: Camera) => drawn.get(target)?.push(...scene.children),
  };
  const sun = new DirectionalLight();
  sun.position.set(0.5, 1, 0.3);
  const map = new ShadowMap(renderer as unknown as WebGLRenderer, sun);
  /** What is in the map that is shown; `undefined` while no shadow is. */
  const shown = () => {
    const { map, intensity } = sun.shadow;
    return intensity > 0 ? drawn.get(map as WebGLRenderTarget | null) : undefined;
  };
  return { map, sun, renderer, shown };
}

/** So many things that cast everywhere. */
function things(count: number): { meshes: readonly Mesh[]; casting: readonly Casting[] } {
  const meshes = Array.from({ length: count }, () => new Mesh(new BoxGeometry(), new MeshStandardMaterial()));
  return { meshes, casting: meshes.map((mesh) => ({ castInto: () => [mesh] })) };
}

/** Each thing once in every tile. */
const inAllTiles = (meshes: readonly Mesh[]) => new Map(meshes.map((mesh) => [mesh, TILES]));
const tally = (drawn: readonly Object3D[] = []) =>
  new Map(drawn.map((mesh) => [mesh, drawn.filter((other) => other === mesh).length]));

/** Draws a bit in each frame until all is there; `look` is called after each bit that is not the last. */
function finish(map: ShadowMap, look: () => void): number {
  let bits = 0;
  for (; map.isBusy && bits <= MANY; bits += 1) {
    map.step(0, 0.6);
    if (map.isBusy) look();
  }
  return bits;
}

it("no shadow is shown before the first map is whole", () => {
  const { map, sun, shown } = lit();
  const { meshes, casting } = things(MANY);
  map.begin(EXTENT, casting);
  expect(shown()).toBeUndefined();
  expect(finish(map, () => expect(shown()).toBeUndefined())).toBeGreaterThan(2);
  expect(sun.shadow.intensity).toBe(0.6);
  expect(tally(shown())).toEqual(inAllTiles(meshes));
});

it("while the next map is drawn the last one stays, whole and where it was, and then they change places at once", () => {
  const { map, sun, shown } = lit();
  const [first, second, third] = [things(MANY), things(MANY), things(1)];
  map.begin(EXTENT, first.casting);
  finish(map, () => {});
  for (const [before, next, x] of [
    [first, second, 5],
    [second, third, 10],
    [third, first, 15],
  ] as const) {
    const matrix = sun.shadow.matrix.clone();
    const old = sun.shadow.map;
    const staysWhole = () => {
      expect(sun.shadow.map).toBe(old);
      expect(sun.shadow.matrix).toEqual(matrix);
      expect(tally(shown())).toEqual(inAllTiles(before.meshes));
    };
    map.begin({ ...EXTENT, centre: new Vector3(x, 0, 0) }, next.casting);
    staysWhole();
    finish(map, staysWhole);
    expect(sun.shadow.map).not.toBe(old);
    expect(sun.shadow.matrix).not.toEqual(matrix);
    expect(tally(shown())).toEqual(inAllTiles(next.meshes));
  }
});

it("a map that was given up half drawn is never shown", () => {
  const { map, shown } = lit();
  const [given, whole] = [things(MANY), things(MANY)];
  map.begin(EXTENT, given.casting);
  map.step(0, 0.6);
  map.stop();
  map.step(1000, 0.6);
  expect(shown()).toBeUndefined();
  map.begin(EXTENT, whole.casting);
  finish(map, () => expect(shown()).toBeUndefined());
  expect(tally(shown())).toEqual(inAllTiles(whole.meshes));
});

it("the renderer and what casts are as they were after each bit", () => {
  const { map, renderer } = lit();
  const { meshes, casting } = things(MANY);
  const own = meshes.map(({ material }) => material);
  const areAsBefore = () => {
    expect([renderer.autoClear, renderer.getRenderTarget()]).toEqual([true, null]);
    expect(meshes.map(({ material }) => material)).toEqual(own);
    expect(meshes.every(({ parent }) => parent === null)).toBe(true);
  };
  map.begin(EXTENT, casting);
  areAsBefore();
  finish(map, areAsBefore);
  areAsBefore();
});
