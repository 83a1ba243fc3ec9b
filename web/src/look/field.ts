/** Returns the text of the field of an event. */
export function fieldText(event: Event): string {
  return (event.target as HTMLInputElement).value;
}

/** Returns the number of the field of an event, for sliders. */
export function fieldNumber(event: Event): number {
  return Number(fieldText(event));
}

/** Returns the number in a text, null if it is none. A comma may be the decimal sign. */
export function numberOf(text: string): number | null {
  const value = Number(text.trim().replace(",", "."));
  return text.trim() === "" || !Number.isFinite(value) ? null : value;
}
