import { describe, expect, it } from "vitest";
import { DAY, expiry, HOUR, onOtherComputers } from "../src/pages/people/tokens.ts";
import { codeIn, signInAddress } from "../src/state/phone.ts";

const NOW = Date.UTC(2027, 0, 31, 12, 0, 0, 600);

describe("expiry", () => {
  it("is a date without fractions of a second, as the service reads it", () => {
    expect(expiry(HOUR, "", NOW)).toBe("2027-01-31T13:00:00Z");
  });

  it("ends no later than the own token", () => {
    expect(expiry(7 * DAY, "2027-02-01T00:00:00+00:00", NOW)).toBe("2027-02-01T00:00:00Z");
  });

  it("is empty for a token without an end, unless the own token has one", () => {
    expect(expiry(0, "", NOW)).toBe("");
    expect(expiry(0, "2027-02-01T00:00:00+00:00", NOW)).toBe("2027-02-01T00:00:00Z");
  });
});

describe("onOtherComputers", () => {
  it.each(["http://localhost:4133", "http://127.0.0.1:4133", "http://127.9.9.9:1", "http://[::1]:4133"])("leaves out the loopback %s", (page) => {
    expect(onOtherComputers(page, [])).toEqual([]);
    expect(onOtherComputers(page, ["https://lab:4134"])).toEqual(["https://lab:4134"]);
  });

  it("begins with the address of the page", () => {
    expect(onOtherComputers("https://192.0.2.7:4134", ["https://lab:4134", "https://192.0.2.7:4134"])).toEqual(["https://192.0.2.7:4134", "https://lab:4134"]);
  });
});

describe("the address that signs a phone in", () => {
  const token = `maya_0123abcd_${"0f".repeat(24)}`;

  it("has the token only behind the #, which no server gets", () => {
    const address = new URL(signInAddress("https://lab:4134", token));
    expect(address.pathname + address.search).toBe("/");
    expect(codeIn(address.hash)).toBe(token);
  });

  it.each(["", "#", "#content", "#sign-in=", "#sign-in=maya_short", `#sign-in=${token}x`, `#x${token}`])("finds no token in %j", (hash) => {
    expect(codeIn(hash)).toBe("");
  });
});
