import { createHash } from "node:crypto";
import { describe, expect, it } from "vitest";
import { qrCode } from "../src/pages/people/qr.ts";

/** Codes that the Python package qrcode 8 makes of the same texts; OpenCV reads them. */
const ADDRESS = `https://192.168.1.17:4134/#sign-in=maya_0123abcd_${"0f".repeat(24)}`;
const ADDRESS_ROWS = `
fe0bd523bf8 820c4494208 badffe8a2e8 ba9084fe2e8 bab2bf01ae8 82bae47aa08 feaaaaaabf8 00dc0688800 be7f684fbe0 d09e17a57a8
da87c898890 49eea511ed8 22416bdd460 44100423a98 93992b94460 1cefa50a350 0acec176d30 416b3b893c8 27de22f22a0 181e8113888
1777aedc870 2c21157f798 5f240a1a080 b464bf91ec0 53fd78df530 8c56b7812d8 73b2a012c00 34bdaea9dd0 6b2242c5870 c8872ca97a8
92f154f2750 903f3d13fd8 af41fadcfa0 00d7d522898 fe7ec495a90 82e1fe8b8c8 badd8c76fa8 bab36bc8558 bab9a0fe7a0 8241ad92e90
fed148471e0`;

/** SHA-256 of the rows as digits, by the length of the text in bytes: one text with the version's greatest length. */
const FULL: [bytes: number, size: number, digest: string][] = [
  [122, 45, "5a9413b844080eb06ad3aebbf7cdfdbdd0ed27f995105d267b781fc7f45683a5"],
  [213, 57, "1e0ff903892de7cb492b5ee4b12c1edcab873e19fd718b2697d2e911e6b6e195"],
];

const digits = (code: boolean[][]) => code.map((row) => row.map(Number).join(""));

describe("qrCode", () => {
  it("makes the code of an address", () => {
    const rows = ADDRESS_ROWS.trim().split(/\s+/).map((row) => [...row].map((one) => Number.parseInt(one, 16).toString(2).padStart(4, "0")).join("").slice(0, 41));
    expect(digits(qrCode(ADDRESS))).toEqual(rows);
  });

  it.each(FULL)("makes the code of %i bytes", (bytes, size, digest) => {
    const code = digits(qrCode("x".repeat(bytes - 3) + "é9"));
    expect(code.length).toBe(size);
    expect(createHash("sha256").update(code.join("\n")).digest("hex")).toBe(digest);
  });

  it.each([14, 26, 42, 62, 84, 106, 122, 152, 180, 213])("uses the smallest version for %i bytes", (bytes) => {
    expect(qrCode("x".repeat(bytes)).length).toBeLessThan(bytes === 213 ? 58 : qrCode("x".repeat(bytes + 1)).length);
  });

  it("refuses a text that is too long", () => {
    expect(() => qrCode("x".repeat(214))).toThrow(RangeError);
  });
});
