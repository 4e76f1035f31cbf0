// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
import { BufferAttribute, DynamicDrawUsage, InstancedBufferAttribute, type BufferGeometry, type TypedArray } from "three";
import type { Dirty } from "../store/dirty";

/** Attributes of geometries that show arrays of a table: they follow when the array grows, and upload only what changed. */
export class Uploads {
  private readonly bound: { name: string; width: number; array: () => TypedArray; make: Maker; attribute: BufferAttribute }[] = [];

  constructor(private readonly geometries: BufferGeometry[]) {}

  bind(name: string, width: number, array: () => TypedArray, make: Maker = plain): this {
    const attribute = make(array(), width);
    this.bound.push({ name, width, array, make, attribute });
    for (const geometry of this.geometries) geometry.setAttribute(name, attribute);
    return this;
  }

  /** Uploads what changed; true where something did. */
  sync(dirty: Dirty, end: number): boolean {
    this.follow();
    return dirty.take(end, this.upload);
  }

  /** Takes up arrays that took the place of smaller ones. */
  follow(): void {
    for (const item of this.bound) {
      if (item.attribute.array === item.array()) continue;
      item.attribute = item.make(item.array(), item.width);
      for (const geometry of this.geometries) {
        geometry.dispose();
        geometry.setAttribute(item.name, item.attribute);
      }
    }
  }

  readonly upload = (first: number, last: number): void => {
    for (const { attribute, width } of this.bound) {
      attribute.addUpdateRange(width * first, width * (last - first));
      attribute.needsUpdate = true;
    }
  };
}

type Maker = (array: TypedArray, width: number) => BufferAttribute;

export function plain(array: TypedArray, width: number): BufferAttribute {
  return new BufferAttribute(array, width).setUsage(DynamicDrawUsage);
}

export function normalized(array: TypedArray, width: number): BufferAttribute {
  return new BufferAttribute(array, width, true).setUsage(DynamicDrawUsage);
}

export function instanced(array: TypedArray, width: number): BufferAttribute {
  return new InstancedBufferAttribute(array, width).setUsage(DynamicDrawUsage);
}

export function instancedNormalized(array: TypedArray, width: number): BufferAttribute {
  return new InstancedBufferAttribute(array, width, true).setUsage(DynamicDrawUsage);
}
