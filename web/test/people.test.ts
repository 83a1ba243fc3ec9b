import { describe, expect, it } from "vitest";
import { DAY, expiry, HOUR, onOtherComputers } from "../src/pages/people/tokens.ts";
import { codeIn, exchange, revoked, signInAddress } from "../src/state/phone.ts";
import { Refusal, Unreachable } from "../src/stream/stream.ts";

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

describe("the exchange of a code", () => {
  const caller = { name: "ana", token: "0123abcd" };
  const answers: Record<string, unknown> = {
    "GET /v1/me": caller,
    "GET /v1/users/ana/tokens": [{ id: "0123abcd", expires: "2027-02-01T00:00:00+00:00" }],
    "POST /v1/users/ana/tokens": { token: "own" },
  };

  /** Exchanges a code, whose revocation ends with `failure`, and returns the token that was kept and the requests. */
  async function exchanged(failure: Error | null) {
    const asked: string[] = [];
    let kept = "";
    const send = (method: string, path: string, body: string, bearer: string) => {
      asked.push([method, path, body, bearer, kept].join(" "));
      return method === "DELETE" && failure ? Promise.reject(failure) : Promise.resolve(answers[`${method} ${path}`]);
    };
    await exchange("code", send, (token) => (kept = token)).catch(() => null);
    return { asked, kept };
  }

  it("gives a token that ends with the code, and revokes the code by it", async () => {
    const { asked, kept } = await exchanged(null);
    expect(asked[2]).toBe('POST /v1/users/ana/tokens {"note":"phone","expires":"2027-02-01T00:00:00Z"} code ');
    expect(asked[3]).toBe("DELETE /v1/tokens/0123abcd  own own");
    expect(kept).toBe("own");
  });

  it("keeps the new token if the code could not be revoked", async () => {
    expect((await exchanged(new Unreachable())).kept).toBe("own");
  });
});

describe("revoked", () => {
  it("takes a token that is gone as revoked, and no other failure", async () => {
    await revoked(() => Promise.resolve({}));
    await revoked(() => Promise.reject(new Refusal(4004, "There is no token.")));
    await expect(revoked(() => Promise.reject(new Unreachable()))).rejects.toBeInstanceOf(Unreachable);
  });
});
