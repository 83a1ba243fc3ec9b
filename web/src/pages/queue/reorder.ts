import { onUnmounted, ref } from "vue";
import { placeAt } from "./order.ts";
import "./reorder.css";

/** The attributes and listeners of a handle (`v-bind`). */
export interface Handle {
  class: string;
  "aria-keyshortcuts": string;
  onPointerdown: (event: PointerEvent) => void;
  onPointermove: (event: PointerEvent) => void;
  onPointerup: () => void;
  onPointercancel: () => void;
}

/** Heights at the edges of the window where a drag scrolls the page [px]: the head above, stop and tabs below. */
const EDGE = { top: 80, bottom: 170 };

/**
 * Reorders a list of rows by dragging a row's handle, and by Alt and the arrow keys. `rows` returns the elements in
 * order; `move` gets the old and the new place, counted from 0. Bind `handle` to the handle of a row, `look` and `key` to
 * the row.
 */
export function useReorder(rows: () => HTMLElement[], move: (from: number, to: number) => void) {
  const from = ref<number | null>(null);
  const to = ref<number | null>(null);

  function middles(): number[] {
    return rows().map((row) => {
      const { top, height } = row.getBoundingClientRect();
      return top + height / 2;
    });
  }

  function begin(event: PointerEvent, place: number): void {
    if (event.button !== 0) return;
    (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
    from.value = to.value = place;
  }

  function drag(event: PointerEvent): void {
    if (from.value === null) return;
    if (event.clientY < EDGE.top) scrollBy(0, -12);
    else if (event.clientY > innerHeight - EDGE.bottom) scrollBy(0, 12);
    to.value = placeAt(event.clientY, middles(), from.value);
  }

  function drop(): void {
    const [start, end] = [from.value, to.value];
    cancel();
    if (start !== null && end !== null && start !== end) move(start, end);
  }

  function cancel(): void {
    from.value = to.value = null;
  }

  function key(event: KeyboardEvent, place: number): void {
    if (event.key === "Escape" && from.value !== null) return cancel();
    if (event.target instanceof HTMLElement && event.target.closest("select, input, textarea") !== null) return; // Alt+↓ opens a list
    if (!event.altKey || (event.key !== "ArrowUp" && event.key !== "ArrowDown")) return;
    event.preventDefault();
    event.stopPropagation();
    const next = place + (event.key === "ArrowUp" ? -1 : 1);
    if (next >= 0 && next < rows().length) move(place, next);
  }

  /** The class of the row at `place` while another one is dragged over it. */
  function look(place: number): Record<string, boolean> {
    const [start, end] = [from.value, to.value];
    const here = start !== null && end === place && start !== end;
    return { "reorder-dragged": start === place, "reorder-above": here && place < start, "reorder-below": here && place > start };
  }

  function handle(place: number): Handle {
    const keys = "Alt+ArrowUp Alt+ArrowDown";
    return { class: "reorder-handle", "aria-keyshortcuts": keys, onPointerdown: (event) => begin(event, place), onPointermove: drag, onPointerup: drop, onPointercancel: cancel };
  }

  onUnmounted(cancel);
  return { handle, key, look };
}
