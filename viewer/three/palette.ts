/**
 * Which paints are there? Colour, roughness, emission and metalness of all plainly painted surfaces stand in one small texture, and each
 * vertex says the number of its paint; so one material draws all of them. Numbers are 32-bit floats, as in uniforms, so that colours
 * stay exact.
 */
import { DataTexture, FloatType, type MeshStandardMaterial, RGBAFormat } from "three";

/** Of a paint: colour and roughness, then emission and metalness. */
const TEXELS = 2;
const NUMBERS = 4 * TEXELS;
/** So that the texture is neither wider nor higher than what every graphics card takes. */
export const PAINTS_IN_ROW = 64;
const FIRST_ROWS = 4;
/** A vertex has 16 bits for the number. */
const MOST_PAINTS = 65_536;

interface Paint {
  readonly key: string;
  users: number;
}

export class Palette {
  /** For shaders. */
  readonly uniform = { value: textureOf(new Float32Array(FIRST_ROWS * PAINTS_IN_ROW * NUMBERS)) };
  private readonly byKey = new Map<string, number>();
  private readonly paints: Paint[] = [];
  /** Numbers that nobody uses any more. */
  private readonly free: number[] = [];

  /** The number of a material's paint, for one user more; `undefined` where all numbers are taken. */
  take(material: MeshStandardMaterial): number | undefined {
    const numbers = Float32Array.from(numbersOf(material));
    const key = numbers.join(" ");
    const number = this.byKey.get(key) ?? this.add(key, numbers);
    const paint = number === undefined ? undefined : this.paints[number];
    if (paint) paint.users += 1;
    return number;
  }

  /** Says that one uses a paint no more. */
  release(number: number): void {
    const paint = this.paints[number];
    if (!paint) return;
    paint.users -= 1;
    if (paint.users > 0) return;
    this.byKey.delete(paint.key);
    this.free.push(number);
  }

  /** Frees what the graphics card has of it; it can be used on. */
  dispose(): void {
    this.uniform.value.dispose();
  }

  private add(key: string, numbers: Float32Array): number | undefined {
    const number = this.free.pop() ?? this.paints.length;
    if (number === MOST_PAINTS) return undefined;
    this.paints[number] = { key, users: 0 };
    this.byKey.set(key, number);
    const { uniform } = this;
    const room = uniform.value.image.data as Float32Array<ArrayBuffer>;
    if (NUMBERS * number === room.length) {
      const grown = new Float32Array(2 * room.length);
      grown.set(room);
      uniform.value.dispose();
      uniform.value = textureOf(grown);
    }
    (uniform.value.image.data as Float32Array).set(numbers, NUMBERS * number);
    uniform.value.needsUpdate = true;
    return number;
  }
}

/** As three.js gives them to the graphics card. */
function numbersOf({ color, roughness, emissive, emissiveIntensity, metalness }: MeshStandardMaterial): number[] {
  return [...color.toArray(), roughness, ...emissive.clone().multiplyScalar(emissiveIntensity).toArray(), metalness];
}

function textureOf(numbers: Float32Array<ArrayBuffer>): DataTexture {
  const width = PAINTS_IN_ROW * TEXELS;
  const texture = new DataTexture(numbers, width, numbers.length / (4 * width), RGBAFormat, FloatType);
  texture.needsUpdate = true;
  return texture;
}
