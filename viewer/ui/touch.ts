/** Is a finger what one points with? Then words speak of buttons and fingers, not of keys. */

export function isTouched(): boolean {
  return matchMedia("(pointer: coarse)").matches;
}
