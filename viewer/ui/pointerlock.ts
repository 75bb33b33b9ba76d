/**
 * Does the mouse turn the head without being dragged? It does while the canvas holds the pointer; a document says so of what stands in its
 * own tree alone, and names the host for what stands in a shadow tree.
 */
export function holdsPointer(canvas: Pick<Element, "getRootNode">): boolean {
  const root = canvas.getRootNode() as Node & Partial<DocumentOrShadowRoot>;
  return root.pointerLockElement === canvas;
}
