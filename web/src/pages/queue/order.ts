/** Returns a list in which the item at `from` has moved to `to`, both counted from 0. */
export function moved<Item>(list: readonly Item[], from: number, to: number): Item[] {
  const found = [...list];
  const [item] = found.splice(from, 1);
  if (item === undefined) return found;
  found.splice(Math.max(0, Math.min(to, found.length)), 0, item);
  return found;
}

/**
 * Returns where an item that is dragged to the height `y` would stand. `middles` are the heights of the middles of all
 * rows; the dragged one is `from`.
 */
export function placeAt(y: number, middles: readonly number[], from: number): number {
  return middles.filter((middle, i) => i !== from && middle < y).length;
}

/** Returns the request that brings a list into the order in which the item at `to` has just arrived there. */
export function besides(ids: readonly number[], to: number): { before: number } | { after: number } | null {
  const [before, after] = [ids[to - 1], ids[to + 1]];
  if (before !== undefined) return { after: before };
  return after === undefined ? null : { before: after };
}
