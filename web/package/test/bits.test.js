import * as ist from 'ist-query';
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {firstDifference, hasOracle, nativeAnswers, pairs, read} from './data.js';
import {rowsText} from './rows.js';

for (const pair of pairs())
  test(`the bits of the native library: ${pair.name}`, async () => {
    await ist.init();
    const wanted = nativeAnswers(pair);
    const got = rowsText(ist, read(pair.a), read(pair.b), read(pair.csv).toString());
    assert.ok(wanted.split('\n').length > 500);
    assert.equal(firstDifference(wanted, got), null);
  });

if (!hasOracle) test('the rows of the oracle', {skip: 'no oracle in IST_SHARED'});
