// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0

/** No table holds ids beyond this: the index by id would not fit in memory. */
const MAX_ID = 1 << 27;

/** Which place in the arrays an id has. Places of erased ids are given to new ones; places never move. */
export class Slots {
  /** Places in use or free: 0 up to this. */
  end = 0;
  /** Living ids. */
  count = 0;
  private slotPlusOne = new Int32Array(1024);
  private readonly free: number[] = [];

  /** The place of `id`, or -1. */
  find(id: number): number {
    return id < this.slotPlusOne.length ? this.slotPlusOne[id]! - 1 : -1;
  }

  /** The place of `id`, a new one where it has none; -1 where the id is out of all bounds. */
  ensure(id: number): number {
    const known = this.find(id);
    if (known >= 0) return known;
    if (id >= MAX_ID) return -1;
    if (id >= this.slotPlusOne.length) {
      const larger = new Int32Array(Math.max(id + 1, 2 * this.slotPlusOne.length));
      larger.set(this.slotPlusOne);
      this.slotPlusOne = larger;
    }
    const slot = this.free.pop() ?? this.end++;
    this.slotPlusOne[id] = slot + 1;
    ++this.count;
    return slot;
  }

  /** Forgets `id`; its place, or -1 where it was not known. */
  erase(id: number): number {
    const slot = this.find(id);
    if (slot < 0) return -1;
    this.slotPlusOne[id] = 0;
    this.free.push(slot);
    --this.count;
    return slot;
  }

  clear(): void {
    this.slotPlusOne.fill(0);
    this.free.length = 0;
    this.end = 0;
    this.count = 0;
  }
}

/** Room for at least `needed` elements: the array itself, or a larger one with the same content. */
export function grown<T extends Float32Array | Uint32Array | Uint16Array | Uint8Array>(array: T, needed: number): T {
  if (needed <= array.length) return array;
  const larger = new (array.constructor as new (length: number) => T)(Math.max(needed, 2 * array.length));
  larger.set(array);
  return larger;
}
