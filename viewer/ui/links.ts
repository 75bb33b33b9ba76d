/**
 * What do links say of a visit? The page's address follows where one is, in this revision, and one follows the links that it is given. They
 * may have been made in another revision, and lead astray.
 */
import { type Pose, readRevision, withoutRevision, writePose } from "../core/movement/address.ts";
import type { Astray } from "../core/movement/astray.ts";
import { ASTRAY, TO_THE_START } from "./astray.ts";
import type { Toast } from "./toast.ts";
import type { Visit } from "./visit.ts";

export class Links {
  /** The revision that links name; none while the page goes on to another one. */
  private linked: string | undefined;
  /** What is to be said of a link that was made in another revision. */
  private ofOldLink = "";

  constructor(
    private readonly revision: string,
    private readonly toast: Toast,
  ) {
    this.linked = revision;
  }

  /** The address says where one is. */
  posed(pose: Pose): void {
    history.replaceState(null, "", writePose(pose, this.linked));
  }

  /** There is another revision. */
  outdated(): void {
    this.offerAnew("This world was published anew while you were in it.");
  }

  /** A door was moved that others have no more, since there is another revision. */
  movedAlone(): void {
    this.offerAnew("This world was published anew: here, doors move for you alone.");
  }

  private offerAnew(text: string): void {
    this.toast.show(text, "Show it", () => {
      this.linked = undefined;
      history.replaceState(null, "", withoutRevision(location.href));
      location.reload();
    });
  }

  /** A link leads out of the world, or where nobody can stand. */
  astray(how: Astray, toTheStart: () => void): void {
    this.toast.show(`${this.ofOldLink}${ASTRAY[how]}`, TO_THE_START, toTheStart);
  }

  /** Begins where the page's address says, and goes wherever it says later. */
  follow(visit: Visit): void {
    const seen = readRevision(location.hash);
    if (seen !== undefined && seen !== this.revision) {
      this.ofOldLink = "This world has changed since the link was made. ";
      this.toast.show(this.ofOldLink.trim(), "All right", () => {});
    }
    if (!visit.followLink(location.hash)) visit.start();
    addEventListener("hashchange", () => {
      this.ofOldLink = "";
      visit.followLink(location.hash);
    });
  }
}
