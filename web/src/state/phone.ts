/** The beginning of the part of an address that signs a phone in: browsers send no server the part behind the #. */
export const CODE_START = "#sign-in=";

const CODE = /^#sign-in=(maya_[0-9a-f]{8}_[0-9a-f]{48})$/;

/** The note of the token of a phone, and that of a code that no phone has read. */
export const PHONE = "phone";
export const CODE_NOTE = "code for a phone";

/** Returns the address that signs a phone in. */
export function signInAddress(origin: string, token: string): string {
  return `${origin}/${CODE_START}${token}`;
}

/** Returns the token in the last part of such an address, "" if it has none. */
export function codeIn(hash: string): string {
  return CODE.exec(hash)?.[1] ?? "";
}

/** Returns a date as the service reads it, "" for never. */
export function stamp(date: Date | string): string {
  return date === "" ? "" : `${new Date(date).toISOString().slice(0, 19)}Z`;
}
