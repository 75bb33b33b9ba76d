/**
 * How does a picture never wait for the graphics card to learn to draw? Programs are compiled beside the page; whoever draws with one, or
 * only asks what it takes, waits until that is done. So they are asked for ahead, those that most models need before the first
 * picture, and what needs another one comes into the picture when that is there.
 *
 * One material takes several: three.js makes others where a plane cuts all off, and for the picture behind what transmits light.
 */
import {
  BackSide,
  BufferAttribute,
  BufferGeometry,
  type Camera,
  DoubleSide,
  FrontSide,
  Group,
  InstancedMesh,
  Line,
  LineBasicMaterial,
  type Material,
  Mesh,
  MeshStandardMaterial,
  NoToneMapping,
  Object3D,
  Plane,
  type Points,
  type Scene,
  type SkinnedMesh,
  Texture,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { type Drawable, impostorMaterial } from "./impostormaterial.ts";
import { paintMaterial } from "./paintmaterial.ts";
import { Palette } from "./palette.ts";
import { Squares } from "./squares.ts";

type Program = NonNullable<WebGLRenderer["info"]["programs"]>[number];

/** What of a renderer is asked for. */
export type Preparing = Pick<
  WebGLRenderer,
  "compile" | "getContext" | "properties" | "clippingPlanes" | "toneMapping" | "getRenderTarget" | "setRenderTarget"
>;

/** What three.js keeps of a material that it has compiled. */
interface Compiled {
  readonly programs?: ReadonlyMap<string, Program>;
}

/** A graphics card, and whether it has forgotten what it was told. */
interface Card {
  readonly gl: WebGL2RenderingContext;
  isLost(): boolean;
}

/** How pictures are drawn, as far as programs differ by that. */
interface Way {
  readonly isCut: boolean;
  /** Of what is behind that which transmits light; three.js draws this first. */
  readonly isBehindGlass: boolean;
}

/** A material on one kind of mesh. */
interface Surface {
  readonly material: Material;
  /** A mesh of that kind, as far as programs differ by it. */
  readonly standIn: Object3D;
  /** How it can be drawn already. */
  readonly ways: Set<string>;
}

/** So often one looks whether the graphics card has come so far. */
const LOOK_AGAIN_MS = 8;
/** Who is not told for so long draws and waits. */
const PATIENCE_MS = 10_000;
/** What takes longer to ask for is asked for in several tasks. */
const SLICE_MS = 4;

export class Programs {
  private compiled = new WeakMap<Program, Promise<void>>();
  /** Programs of which three.js knows what they take. */
  private known = new WeakSet<Program>();
  /** All that was prepared and can still be drawn, by material and kind of mesh. */
  private readonly surfaces = new Map<Material, Map<string, Surface>>();
  private isCut = false;
  private hasGlass = false;
  private readonly behindGlass = new WebGLRenderTarget(1, 1);

  /** Of what is drawn in a scene. */
  constructor(
    private readonly renderer: Preparing,
    private readonly scene: Scene,
    private readonly camera: Camera,
  ) {}

  /** Waits until what is below a node can be drawn without waiting, and for nothing else that is compiled meanwhile. */
  async prepare(root: Object3D): Promise<void> {
    const drawn = this.surfacesOf(root);
    const bringsGlass = !this.hasGlass && drawn.some(({ material }) => isTransmitting(material));
    if (bringsGlass) this.hasGlass = true;
    // All that can be drawn already is drawn behind it, too.
    await this.prepareAll(bringsGlass ? this.all() : drawn);
  }

  /** Prepares what nobody waits for. What is wrong with it is said, and met again by whoever draws it. */
  async prepareAhead(root: Object3D): Promise<void> {
    try {
      await this.prepare(root);
    } catch (error) {
      console.error("what is drawn later cannot be prepared", error);
    }
  }

  /** Waits until all that was prepared can be drawn where a plane cuts it off; until that ends, the rest is prepared for it, too. */
  async prepareToCut(): Promise<void> {
    this.isCut = true;
    await this.prepareAll(this.all());
  }

  endCut(): void {
    this.isCut = false;
  }

  /** Waits until all that was prepared can be drawn by a graphics card that has lost it. */
  async renew(): Promise<void> {
    this.compiled = new WeakMap();
    this.known = new WeakSet();
    const all = this.all();
    for (const { ways } of all) ways.clear();
    await this.prepareAll(all);
  }

  private async prepareAll(surfaces: readonly Surface[]): Promise<void> {
    let end_ms = performance.now() + SLICE_MS;
    for (const surface of surfaces) {
      for (const way of this.waysOf(surface)) {
        const name = `${way.isCut} ${way.isBehindGlass}`;
        if (surface.ways.has(name)) continue;
        if (performance.now() > end_ms) {
          await nextTask();
          end_ms = performance.now() + SLICE_MS;
        }
        this.compile(surface, way);
        surface.ways.add(name);
      }
    }
    await this.finish(new Set(surfaces.flatMap(({ material }) => this.programsOf(material))));
  }

  private waysOf({ material }: Surface): Way[] {
    const cuts = this.isCut ? [false, true] : [false];
    const places = this.hasGlass && isSeenThrough(material) ? [false, true] : [false];
    return cuts.flatMap((isCut) => places.map((isBehindGlass) => ({ isCut, isBehindGlass })));
  }

  /** Asks for the program of a material, as for a picture that is drawn in this way. */
  private compile({ standIn, material }: Surface, { isCut, isBehindGlass }: Way): void {
    const { renderer, scene, camera } = this;
    const { clippingPlanes } = renderer;
    // Where it is does not matter, only that there is one.
    renderer.clippingPlanes = isCut ? [new Plane()] : [];
    const compile = () => renderer.compile(standIn, camera, scene);
    try {
      if (isBehindGlass) this.atGlass(material, compile);
      else compile();
    } finally {
      renderer.clippingPlanes = clippingPlanes;
    }
  }

  /** Does something as three.js draws what is behind glass. */
  private atGlass(material: Material, work: () => void): void {
    const { renderer } = this;
    const { toneMapping } = renderer;
    const { side } = material;
    const target = renderer.getRenderTarget();
    renderer.toneMapping = NoToneMapping;
    renderer.setRenderTarget(this.behindGlass);
    // What transmits light itself shows its back there.
    if (isTransmitting(material)) material.side = BackSide;
    try {
      work();
    } finally {
      material.side = side;
      renderer.toneMapping = toneMapping;
      renderer.setRenderTarget(target);
    }
  }

  private all(): Surface[] {
    return [...this.surfaces.values()].flatMap((kinds) => [...kinds.values()]);
  }

  private surfacesOf(root: Object3D): Surface[] {
    const found = new Set<Surface>();
    root.traverse((node) => {
      const { material } = node as Partial<Mesh>;
      for (const one of material ? [material].flat() : []) found.add(this.surfaceOf(node as Mesh, one));
    });
    return [...found];
  }

  private surfaceOf(node: Mesh, material: Material): Surface {
    const kinds = this.surfaces.get(material) ?? this.take(material);
    const kind = kindOf(node);
    const surface = kinds.get(kind) ?? { material, standIn: standInFor(node, material), ways: new Set() };
    kinds.set(kind, surface);
    return surface;
  }

  /** Knows a material until it is disposed of. */
  private take(material: Material): Map<string, Surface> {
    const kinds = new Map<string, Surface>();
    this.surfaces.set(material, kinds);
    const forget = () => {
      material.removeEventListener("dispose", forget);
      this.surfaces.delete(material);
    };
    material.addEventListener("dispose", forget);
    return kinds;
  }

  private programsOf(material: Material): Program[] {
    const { programs } = this.renderer.properties.get(material) as Compiled;
    return [...(programs?.values() ?? [])];
  }

  /** Waits until programs are compiled, all of them: what is asked of one meanwhile waits for the others, too. */
  private async finish(programs: ReadonlySet<Program>): Promise<void> {
    const unknown = [...programs].filter((program) => !this.known.has(program));
    if (unknown.length === 0) return;
    const card = this.card();
    await Promise.all(unknown.map((program) => this.whenCompiled(card, program)));
    await whenIdle(card);
    for (const program of unknown) {
      if (!this.known.has(program) && !card.isLost()) this.learn(card.gl, program);
    }
  }

  /** The graphics card as it is, until it is lost to the page; it may be back by then, and knows nothing of what it was told before. */
  private card(): Card {
    const gl = this.renderer.getContext() as WebGL2RenderingContext;
    const { known } = this;
    return { gl, isLost: () => gl.isContextLost() || this.known !== known };
  }

  private whenCompiled(card: Card, program: Program): Promise<void> {
    const known = this.compiled.get(program);
    if (known) return known;
    // They are few, and dear: each stays when the last that was drawn with it goes.
    program.usedTimes += 1;
    const compiled = whenCompiled(card, program.program as WebGLProgram);
    this.compiled.set(program, compiled);
    return compiled;
  }

  /** From now on three.js knows what a program takes. */
  private learn(gl: WebGL2RenderingContext, program: Program): void {
    this.known.add(program);
    const isLinked = gl.getProgramParameter(program.program as WebGLProgram, gl.LINK_STATUS);
    if (!isLinked)
      console.error(`${program.name} cannot be drawn`, gl.getProgramInfoLog(program.program as WebGLProgram));
    program.getUniforms();
  }
}

/** What of a mesh programs differ by. */
function kindOf(node: Mesh): string {
  const { attributes, morphAttributes } = node.geometry;
  const sizes = Object.entries(attributes).map(([name, { itemSize }]) => name + itemSize);
  const morphs = Object.entries(morphAttributes).map(([name, targets]) => name + targets?.length);
  const instances = node instanceof InstancedMesh ? `instances ${node.instanceColor !== null}` : "";
  return `${node.type} ${instances} ${sizes.sort()} ${morphs.sort()}`;
}

/** What three.js takes for a mesh of the same kind when it makes a program. The mesh itself would be kept with all its vertices. */
function standInFor(node: Mesh, material: Material): Object3D {
  const sizesOf = <T extends object>(all: Readonly<Record<string, T>>, size: (one: T) => unknown) =>
    Object.fromEntries(Object.entries(all).map(([name, one]) => [name, size(one)]));
  const { attributes, morphAttributes } = node.geometry;
  const geometry = {
    attributes: sizesOf(attributes, ({ itemSize }) => ({ itemSize })),
    morphAttributes: sizesOf(morphAttributes as Record<string, unknown[]>, ({ length }) => ({ length })),
  };
  const { isMesh, isPoints, isLine, isSkinnedMesh, isInstancedMesh, instanceColor, morphTexture } = node as Mesh &
    Partial<Points & Line & SkinnedMesh & InstancedMesh>;
  const kind = { isMesh, isPoints, isLine, isSkinnedMesh, isInstancedMesh };
  const instances = { instanceColor: instanceColor ? {} : null, morphTexture: morphTexture ? {} : null };
  return Object.assign(new Object3D(), kind, instances, { geometry, material });
}

function isTransmitting(material: Material & { readonly transmission?: number }): boolean {
  return (material.transmission ?? 0) > 0;
}

/** Whether three.js draws it behind what transmits light: all that is opaque, and of that itself what has two sides. */
function isSeenThrough(material: Material): boolean {
  return isTransmitting(material) ? material.side === DoubleSide : !material.transparent;
}

/** What most models need: what is painted by its vertices, seen from one side or from both, and what is seen through. */
export function usualMeshes(): Object3D {
  const geometry = corners();
  const palette = new Palette().uniform;
  const painted = [FrontSide, DoubleSide].map((side) =>
    paintMaterial(palette, { side, vertexColors: false, flatShading: false }),
  );
  return new Group().add(
    ...painted.map((material) => new InstancedMesh(geometry, material, 0)),
    new Mesh(geometry, new MeshStandardMaterial({ transparent: true })),
  );
}

/** What many worlds have, and seldom in their first picture: lines, and what is drawn by its pictures. */
export function rarerMeshes(): Object3D {
  const impostor: Drawable = { mapping: "octahedral", views: 2, size_px: 1, frames: 1, centre: [0, 0, 0], radius: 1 };
  return new Group().add(
    new Line(corners(), new LineBasicMaterial()),
    new Squares(impostorMaterial(impostor, new Texture(), new Texture()), impostor, 0),
  );
}

function corners(): BufferGeometry {
  const geometry = new BufferGeometry();
  for (const name of ["position", "normal"]) geometry.setAttribute(name, new BufferAttribute(new Float32Array(9), 3));
  return geometry;
}

/** Goes on in a task of its own. */
export function nextTask(): Promise<void> {
  return new Promise((next) => setTimeout(next));
}

/** Waits until a program is compiled, without asking anything that the browser would have to wait for. */
async function whenCompiled(card: Card, program: WebGLProgram): Promise<void> {
  const { gl } = card;
  const parallel = gl.getExtension("KHR_parallel_shader_compile");
  // Without the extension: what was begun before is done when the graphics card is idle.
  if (parallel) await until(card, () => gl.getProgramParameter(program, parallel.COMPLETION_STATUS_KHR) as boolean);
}

/** Waits until the graphics card has done what it was told, so that it answers at once. */
async function whenIdle(card: Card): Promise<void> {
  const { gl } = card;
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  await until(card, () => !fence || gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED);
  if (!card.isLost()) gl.deleteSync(fence);
}

async function until({ isLost }: Card, isDone: () => boolean): Promise<void> {
  const end_ms = performance.now() + PATIENCE_MS;
  do await new Promise((look) => setTimeout(look, LOOK_AGAIN_MS));
  while (!isLost() && performance.now() < end_ms && !isDone());
}
