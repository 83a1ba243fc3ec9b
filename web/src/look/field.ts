/** Returns the text of the field of an event. */
export function fieldText(event: Event): string {
  return (event.target as HTMLInputElement).value;
}

/** Returns the number of the field of an event, for sliders. */
export function fieldNumber(event: Event): number {
  return Number(fieldText(event));
}
