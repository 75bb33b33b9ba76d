/** Which terminals are written like a call? Their parameters, and what each is when it is not given. */

export type Formals = readonly (readonly [name: string, initial: number | undefined])[];

export const SOLIDS = {
  box: [
    ["width", undefined],
    ["height", undefined],
    ["depth", undefined],
  ],
  cone: [
    ["radius", undefined],
    ["height", undefined],
    ["top", 0],
    ["sides", 0],
    ["closed", 1],
  ],
  cylinder: [
    ["radius", undefined],
    ["height", undefined],
    ["sides", 0],
    ["closed", 1],
  ],
  lathe: [
    ["profile", undefined],
    ["sides", 0],
    ["smooth", 0],
  ],
  mesh: [
    ["points", undefined],
    ["faces", undefined],
  ],
  polygon: [["points", undefined]],
  prism: [
    ["footprint", undefined],
    ["height", undefined],
  ],
  sphere: [
    ["radius", undefined],
    ["sides", 0],
  ],
} as const satisfies Record<string, Formals>;

/** How many parameters of a solid are lists: its first. */
export function listsOf(kind: SolidKind): number {
  if (kind === "mesh") return 2;
  return kind === "lathe" || kind === "polygon" || kind === "prism" ? 1 : 0;
}

/** What an author can say of the pictures that stand for a part from far away. */
export const IMPOSTOR: Formals = [
  ["views", 8],
  ["size", 64],
  ["below", 0],
  ["frames", 1],
  ["stride", 1.4],
];

export type SolidKind = keyof typeof SOLIDS;

const KINDS = Object.keys(SOLIDS) as SolidKind[];

/** The kind itself, not what was read: browsers compare the same string sooner than an equal one. */
export function solidNamed(name: string): SolidKind | undefined {
  return KINDS.find((kind) => kind === name);
}

/** Parameters of a solid. */
export function formalsOf(kind: SolidKind): Formals {
  return SOLIDS[kind];
}

/** Sides of a round solid whose author does not say how many, by level of detail. */
export const SIDES = [4, 6, 8, 12, 16] as const;
