/**
 * Which lights are there, and how dark is a shadow? Two lamps from unequal sides, so that walls of every direction differ in tone, and light
 * from all around (`skylight.ts`). Only the first lamp, the sun, casts shadows.
 */
import { Color, DirectionalLight, Vector3 } from "three";

/** Light that comes from one direction. */
export interface Lamp {
  /** Towards it, of length 1. */
  readonly towards: Vector3;
  readonly colour: Color;
  readonly intensity: number;
}

export const SUN: Lamp = {
  towards: new Vector3(0.55, 0.9, 0.35).normalize(),
  colour: new Color(0xffecd0),
  intensity: 2,
};
export const FILL: Lamp = {
  towards: new Vector3(-0.7, 0.35, -0.4).normalize(),
  colour: new Color(0xbfd4f2),
  intensity: 0.55,
};
/** How bright the light from all around is beside the lamps. */
export const SKYLIGHT = 0.68;
/**
 * How much of the sun a shadow takes: light comes from walls and ground, too, so that rooms are not dark. Far shadows on the ground are
 * strips of a few pixels to one who stands there: they must be much darker than one stone is beside another.
 */
export const DARKNESS = 0.8;

export function lamp({ towards, colour, intensity }: Lamp): DirectionalLight {
  const light = new DirectionalLight(colour, intensity);
  light.position.copy(towards);
  return light;
}
