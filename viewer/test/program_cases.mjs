export const programCases = [];
