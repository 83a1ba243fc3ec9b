export interface Box {
  left: number;
  top: number;
  width: number;
  height: number;
}

/** The distance of a card from its target, and from the edge of the window [px]. */
export const GAP = 14;

/** Nothing comes closer to the stop button than this [px]. */
export const CLEAR = 24;

function apart(one: Box, other: Box, distance: number): boolean {
  return (
    one.left >= other.left + other.width + distance ||
    other.left >= one.left + one.width + distance ||
    one.top >= other.top + other.height + distance ||
    other.top >= one.top + one.height + distance
  );
}

/**
 * Returns where a card of a size is put: beside its target, in the window, and away from `stop` in every case. Without
 * a good place beside the target it is put in the middle, or as far up as it has to be.
 */
export function placed(card: { width: number; height: number }, target: Box | null, stop: Box | null, view: { width: number; height: number }): Box {
  const inside = (value: number, size: number, all: number) => Math.max(GAP, Math.min(value, all - size - GAP));
  const box = (left: number, top: number): Box => ({ ...card, left: inside(left, card.width, view.width), top: inside(top, card.height, view.height) });
  const clear = (one: Box) => stop === null || apart(one, stop, CLEAR);
  const beside: Box[] = [];
  if (target !== null) {
    const [centre, middle] = [target.left + (target.width - card.width) / 2, target.top + (target.height - card.height) / 2];
    const gap = target === stop ? CLEAR : GAP;
    const sides = [box(target.left + target.width + gap, middle), box(target.left - card.width - gap, middle)];
    const ends = [box(centre, target.top + target.height + gap), box(centre, target.top - card.height - gap)];
    beside.push(...(target === stop ? [...ends, ...sides] : [...sides, ...ends]));
  }
  const good = beside.find((one) => clear(one) && apart(one, target as Box, 0));
  if (good !== undefined) return good;
  const centre = box((view.width - card.width) / 2, (view.height - card.height) / 2);
  if (clear(centre)) return centre;
  return box(centre.left, (stop as Box).top - CLEAR - card.height);
}
