/** Which panels does the page have, and which of them are open at once? As many as one likes; on small screens one at a time. */
import { element } from "./elements.ts";
import { keepFocus } from "./focus.ts";
import { Fold } from "./fold.ts";
import { HelpPanel } from "./help.ts";
import { InspectorPanel, type PanelParts } from "./inspector/panel.ts";
import { MapPanel } from "./map.ts";

/** What opens and closes. */
interface Openable {
  toggle(open: boolean): void;
}

export interface Panels {
  readonly inspector: InspectorPanel;
  readonly map: MapPanel;
  readonly help: HelpPanel;
}

/** Puts the panels into the page. */
export function makePanels(parts: Omit<PanelParts, "toggled">): Panels {
  const { visit, company, announcer } = parts;
  const inspectorToggle = element("inspector-toggle", HTMLButtonElement);
  const inspector = new InspectorPanel({
    ...parts,
    toggled: (open) => {
      document.body.classList.toggle("inspecting", open);
      inspectorToggle.setAttribute("aria-pressed", String(open));
      announcer.say("inspector", open ? "The inspector is open" : "The inspector is closed");
      if (open) makeRoom(help, map, ...folds);
      keepFocus();
    },
  });
  document.body.append(inspector.element);
  inspectorToggle.onclick = () => inspector.toggle();
  const mapToggle = element("map-toggle", HTMLButtonElement);
  const map = new MapPanel(visit, announcer, (open) => {
    mapToggle.setAttribute("aria-pressed", String(open));
    announcer.say("map panel", open ? "The map is open" : "The map is closed");
    if (open) makeRoom(inspector, help, ...folds);
    keepFocus();
  });
  element("middle", HTMLDivElement).append(map.element);
  mapToggle.onclick = () => map.toggle();
  map.people = () => company.movers.map(({ position }) => position);
  const help = new HelpPanel((open) => {
    if (open) makeRoom(inspector, map, ...folds);
  });
  const folds = makeFolds(help, map);
  return { inspector, map, help };
}

/** What can be folded away: figures, and places to go. */
function makeFolds(...panels: readonly Openable[]): readonly Fold[] {
  const figures = new Fold(
    element("hud-fold", HTMLButtonElement),
    element("figures", HTMLDListElement),
    !isSmall(),
    (open) => open && makeRoom(...panels, places),
  );
  const places = new Fold(
    element("choices-fold", HTMLButtonElement),
    element("places", HTMLDivElement),
    !isSmall(),
    (open) => open && makeRoom(...panels, figures),
  );
  // Both may be remembered as unfolded.
  if (places.open) makeRoom(figures);
  return [figures, places];
}

/** Whether one panel at a time is all that there is room for. */
function isSmall(): boolean {
  return matchMedia("(max-width: 640px), (max-height: 480px)").matches;
}

/** Closes these where there is no room for more. */
function makeRoom(...others: readonly Openable[]): void {
  if (isSmall()) for (const other of others) other.toggle(false);
}
