/** How large is a person? */

/**
 * From the floor to the eyes. It must agree with the bake, which puts eyes so high into cells (`crates/bake/src/records/standing.rs`)
 * and at viewpoints of plans (`crates/bake/src/import/plan`): who begins there stands on the floor, and is drawn with the feet on it.
 */
export const EYE_HEIGHT_M = 1.65;
