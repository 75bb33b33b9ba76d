/** What are the scenes of a tree called, where one chooses between them? By their titles, and by their names too where titles are the same. */
import type { SceneSummary } from "../core/documents/documents.ts";

export function labelled(scenes: readonly SceneSummary[]): { scene: string; label: string }[] {
  const isShared = (title: string) => scenes.filter((other) => other.title === title).length > 1;
  return scenes.map(({ scene, title }) => ({ scene, label: isShared(title) ? `${title} (${scene})` : title }));
}
