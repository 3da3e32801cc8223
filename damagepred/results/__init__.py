"""What is read out of solved walls and studies: judged again, cracks, scales, tables."""
