import {
  BufferAttribute,
  BufferGeometry,
  Camera,
  InstancedMesh,
  type Material,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  Scene,
} from "three";
import { expect, it, vi } from "vitest";
import { type Preparing, Programs } from "./programs.ts";

const [LINK_STATUS, SYNC_STATUS, SIGNALED, COMPLETION_STATUS_KHR] = [1, 2, 3, 4];

/**
 * A graphics card that has done what it was told to when `done` is set, except for one kind of material, and notes what makes a page wait
 * for it. Each kind of material has one program.
 */
function graphicsCard({ isParallel = false, never = "" } = {}) {
  const notes = { compiled: 0, done: false, asked: [] as string[] };
  const isDone = (program: unknown) => notes.done && program !== never;
  const gl = {
    LINK_STATUS,
    SYNC_STATUS,
    SIGNALED,
    SYNC_GPU_COMMANDS_COMPLETE: 5,
    flush: () => {},
    isContextLost: () => false,
    getExtension: () => (isParallel ? { COMPLETION_STATUS_KHR } : null),
    fenceSync: () => ({}),
    deleteSync: () => {},
    getSyncParameter: () => (notes.done ? SIGNALED : 0),
    getProgramParameter: (program: unknown, name: number) => {
      if (name === COMPLETION_STATUS_KHR) return isDone(program);
      notes.asked.push(`status, ${notes.done ? "done" : "not done"}`);
      return true;
    },
  };
  const programs: { program: string }[] = [];
  const byMaterial = new Map<Material, Map<string, object>>();
  const renderer = {
    info: { programs },
    properties: { get: (material: Material) => ({ programs: byMaterial.get(material) }) },
    getContext: () => gl,
    compile: ({ material }: Mesh<BufferGeometry, Material>) => {
      notes.compiled += 1;
      const known = programs.find(({ program }) => program === material.type);
      const getUniforms = () => notes.asked.push("uniforms");
      const program = known ?? { program: material.type, name: "paint", usedTimes: 1, getUniforms };
      if (!known) programs.push(program);
      byMaterial.set(material, new Map([["paint", program]]));
    },
  };
  return { notes, programs, renderer: renderer as unknown as Preparing };
}

const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(9), 3));
const later = (ms: number) => new Promise((over) => setTimeout(over, ms));

it.each([false, true])("a program is asked for nothing before it is compiled (told when: %s)", async (isParallel) => {
  const { notes, programs, renderer } = graphicsCard({ isParallel });
  const prepared = new Programs(renderer, new Scene(), new Camera()).prepare(
    new Mesh(geometry, new MeshStandardMaterial()),
  );
  await later(50);
  expect([notes.compiled, notes.asked]).toEqual([1, []]);
  notes.done = true;
  await prepared;
  expect(notes.asked).toEqual(["status, done", "uniforms"]);
  // It outlives its first material.
  expect(programs).toMatchObject([{ usedTimes: 2 }]);
});

it("a material is prepared once for meshes of one kind", async () => {
  const { notes, renderer } = graphicsCard();
  notes.done = true;
  const programs = new Programs(renderer, new Scene(), new Camera());
  const material = new MeshStandardMaterial();
  for (const mesh of [new Mesh(geometry, material), new Mesh(geometry, material)]) await programs.prepare(mesh);
  expect(notes.compiled).toBe(1);
  await programs.prepare(new InstancedMesh(geometry, material, 0));
  expect(notes.compiled).toBe(2);
});

it("who needs other programs does not wait for one that is compiled meanwhile", async () => {
  const { notes, renderer } = graphicsCard({ isParallel: true, never: "MeshBasicMaterial" });
  notes.done = true;
  const programs = new Programs(renderer, new Scene(), new Camera());
  const prepared: string[] = [];
  const prepare = (name: string, material: Material) =>
    programs.prepare(new Mesh(geometry, material)).then(() => prepared.push(name));
  void prepare("rare", new MeshBasicMaterial());
  void prepare("as rare", new MeshBasicMaterial());
  await Promise.race([prepare("usual", new MeshStandardMaterial()), later(500)]);
  expect(prepared).toEqual(["usual"]);
});

it("what cannot be prepared ahead is said, and tried again by who needs it", async () => {
  const { notes, renderer } = graphicsCard();
  notes.done = true;
  const said = vi.spyOn(console, "error").mockImplementation(() => {});
  const broken = new Error("no such shader");
  const compile = vi.spyOn(renderer, "compile").mockImplementationOnce(() => {
    throw broken;
  });
  const programs = new Programs(renderer, new Scene(), new Camera());
  const mesh = new Mesh(geometry, new MeshStandardMaterial());
  await programs.prepareAhead(mesh);
  expect(said.mock.calls).toEqual([[expect.any(String), broken]]);
  said.mockRestore();
  await programs.prepare(mesh);
  expect([compile.mock.calls.length, notes.compiled]).toEqual([2, 1]);
});
