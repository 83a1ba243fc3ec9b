const LOOPBACK = /^(localhost|127(\.\d+){3}|\[::1\])$/;

/**
 * Returns the origins at which another device reaches this service: that of the page, unless it is this computer's
 * own loopback, and those on which the service listens for others.
 */
export function onOtherComputers(page: string, remote: readonly string[]): string[] {
  const near = LOOPBACK.test(new URL(page).hostname);
  return [...new Set(near ? remote : [page, ...remote])];
}
