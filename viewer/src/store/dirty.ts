// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

const BLOCK_BITS = 11;

/** Which places of a table changed since they were last uploaded, in blocks of 2048. */
export class Dirty {
  private blocks = new Uint8Array(64);
  private any = false;

  mark(slot: number): void {
    const block = slot >> BLOCK_BITS;
    if (block >= this.blocks.length) {
      const larger = new Uint8Array(2 * block);
      larger.set(this.blocks);
      this.blocks = larger;
    }
    this.blocks[block] = 1;
    this.any = true;
  }

  /** Tells the changed ranges [first, last) below `end`, neighbours together, and forgets them. False where there is none. */
  take(end: number, tell: (first: number, last: number) => void): boolean {
    if (!this.any) return false;
    const last = Math.min(this.blocks.length, (end >> BLOCK_BITS) + 1);
    for (let block = 0; block < last; ) {
      if (!this.blocks[block]) {
        ++block;
        continue;
      }
      const first = block;
      while (block < last && this.blocks[block]) ++block;
      tell(first << BLOCK_BITS, Math.min(end, block << BLOCK_BITS));
    }
    this.clear();
    return true;
  }

  clear(): void {
    this.blocks.fill(0);
    this.any = false;
  }
}
