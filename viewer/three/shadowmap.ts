/**
 * How does the shadow map come about? What casts shadows is drawn as the sun sees it, into one tile after the other (`shading.ts`), some of
 * it in each frame and into a map that nobody looks at yet; when all of it is there, the two maps change places. So no frame
 * waits for it, and there is never half of it to see.
 */
import {
  DepthTexture,
  type DirectionalLight,
  LessEqualCompare,
  LinearFilter,
  type Material,
  Matrix4,
  type Mesh,
  OrthographicCamera,
  RedFormat,
  Scene,
  UnsignedIntType,
  Vector3,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { Casters } from "./casters.ts";
import { DEPTH_REACH, TILE_GROWTH, TILE_PX, TILES } from "./shading.ts";
import { type Extent, sunFromWorld } from "./shadowturns.ts";
import { ViewVolume } from "./viewvolume.ts";

/** Draws something in some places. */
export interface Casting {
  /** Turns to the sun what stands in a volume, and answers what draws that, until it is turned to the eye again. */
  castInto(volume: ViewVolume): readonly Mesh[];
}

/** So many at a time: between them one looks at the clock. */
const BATCH = 12;

/** From clip space to where a texture is looked at. */
const TEXTURE_FROM_CLIP = new Matrix4().set(0.5, 0, 0, 0.5, 0, 0.5, 0, 0.5, 0, 0, 0.5, 0.5, 0, 0, 0, 1);

interface Tile {
  readonly camera: OrthographicCamera;
  readonly volume: ViewVolume;
}

/** A map that is being drawn. */
interface Work {
  readonly tiles: readonly Tile[];
  readonly left: Iterator<Casting>;
}

export class ShadowMap {
  readonly casters = new Casters();
  private readonly maps = [makeMap(), makeMap()] as [WebGLRenderTarget, WebGLRenderTarget];
  private readonly scene = new Scene();
  private work: Work | undefined;

  /** `sun` casts no shadow before the first map is there. */
  constructor(
    private readonly renderer: WebGLRenderer,
    private readonly sun: DirectionalLight,
  ) {
    this.scene.matrixWorldAutoUpdate = false;
    sun.castShadow = true;
    sun.shadow.intensity = 0;
    renderer.shadowMap.enabled = true;
    // three.js would draw it in one go, and of what is in view only.
    renderer.shadowMap.autoUpdate = false;
  }

  /** Whether one is being drawn. */
  get isBusy(): boolean {
    return this.work !== undefined;
  }

  /** Begins to draw another one of all that casts. */
  begin(extent: Extent, casting: Iterable<Casting>): void {
    const tiles = tilesOf(extent, this.sun.position);
    this.work = { tiles, left: casting[Symbol.iterator]() };
    this.draw([], true);
  }

  /** Goes on for so long; `intensity` is how dark shadows are, in the map that is shown when it is there. */
  step(ms: number, intensity: number): void {
    const { work } = this;
    if (!work) return;
    const end_ms = performance.now() + ms;
    let isDone: boolean | undefined = false;
    do {
      const some: Casting[] = [];
      for (let next = work.left.next(); ; next = work.left.next()) {
        isDone = next.done;
        if (isDone) break;
        some.push(next.value);
        if (some.length === BATCH) break;
      }
      this.draw(some, false);
    } while (!isDone && performance.now() < end_ms);
    if (isDone) this.show(work, intensity);
  }

  /** Forgets what was begun: for a graphics card that has lost it. */
  stop(): void {
    this.work = undefined;
    this.sun.shadow.intensity = 0;
  }

  /** Gives back what it takes of the graphics card; from then on there are no shadows. */
  dispose(): void {
    this.stop();
    this.sun.shadow.map = null;
    for (const map of this.maps) {
      map.depthTexture?.dispose();
      map.dispose();
    }
    this.casters.dispose();
  }

  private show({ tiles }: Work, intensity: number): void {
    this.work = undefined;
    this.maps.reverse();
    const { shadow } = this.sun;
    shadow.map = this.maps[1];
    shadow.intensity = intensity;
    const widest = tiles[tiles.length - 1]?.camera;
    if (!widest) return;
    shadow.matrix.multiplyMatrices(TEXTURE_FROM_CLIP, widest.projectionMatrix).multiply(widest.matrixWorldInverse);
  }

  /** Draws some of what casts into all tiles, after these were emptied. */
  private draw(some: readonly Casting[], isFirst: boolean): void {
    const { renderer, scene, maps, work } = this;
    const [map] = maps;
    const { autoClear } = renderer;
    const target = renderer.getRenderTarget();
    renderer.autoClear = false;
    try {
      if (isFirst) {
        confine(map, 0, TILES);
        renderer.setRenderTarget(map);
        renderer.clear();
      }
      work?.tiles.forEach(({ camera, volume }, i) => {
        const drawn = some.flatMap((casting) => casting.castInto(volume));
        if (drawn.length === 0) return;
        confine(map, i, 1);
        renderer.setRenderTarget(map);
        this.as(drawn, () => renderer.render(scene, camera));
      });
    } finally {
      renderer.autoClear = autoClear;
      renderer.setRenderTarget(target);
    }
  }

  /** Has these stand in the scene, as they cast, without leaving the one where they are. */
  private as(drawn: readonly Mesh[], work: () => void): void {
    const own = drawn.map(({ material }): Material | Material[] => material);
    for (const mesh of drawn) mesh.material = this.casters.of(mesh);
    this.scene.children = [...drawn];
    try {
      work();
    } finally {
      this.scene.children = [];
      drawn.forEach((mesh, i) => {
        const material = own[i];
        if (material) mesh.material = material;
      });
    }
  }
}

/** Draws into so many tiles, from this one on. */
function confine(map: WebGLRenderTarget, tile: number, count: number): void {
  map.viewport.set(0, tile * TILE_PX, TILE_PX, count * TILE_PX);
  map.scissor.copy(map.viewport);
  map.scissorTest = true;
}

/** The finest first. */
function tilesOf({ centre, reach_m }: Extent, sun: Vector3): Tile[] {
  const depth_m = DEPTH_REACH * reach_m;
  const worldFromSun = sunFromWorld(sun).transpose();
  return Array.from({ length: TILES }, (_, i) => {
    const side_m = reach_m / TILE_GROWTH ** (TILES - 1 - i);
    const camera = new OrthographicCamera(-side_m, side_m, side_m, -side_m, 0, 2 * depth_m);
    const towards = new Vector3().setFromMatrixColumn(worldFromSun, 2);
    camera.position.copy(centre).addScaledVector(towards, depth_m);
    camera.quaternion.setFromRotationMatrix(worldFromSun);
    camera.updateMatrixWorld();
    return { camera, volume: new ViewVolume(camera) };
  });
}

function makeMap(): WebGLRenderTarget {
  const [width, height] = [TILE_PX, TILES * TILE_PX];
  const depthTexture = new DepthTexture(width, height, UnsignedIntType);
  depthTexture.compareFunction = LessEqualCompare;
  depthTexture.magFilter = LinearFilter;
  depthTexture.minFilter = LinearFilter;
  return new WebGLRenderTarget(width, height, { depthTexture, format: RedFormat, generateMipmaps: false });
}
